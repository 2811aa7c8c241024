"""The user's decision on front and back: at the start, and against the feet."""

from dataclasses import replace

import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import SETUP, STANDING, rays, reversed_of, tracking
from tests.support.tracker_ring import FRAME_NS, ahead, played, ring, setup, simulated_person, standing_at, t_pose_at
from tests.support.tracker_scenes import rays_alone
from zenocap.services.tracker.filter.filter_step import no_pose
from zenocap.services.tracker.initialization import decisions
from zenocap.services.tracker.parameters import START_AFTER_NS, T_POSE_FRAMES
from zenocap.services.tracker.states import Options, TrackerSetup, Turn

SEED, YAW = 3, 0.5


def with_options(config: TrackerSetup, **changes: object) -> TrackerSetup:
    return replace(config, options=replace(config.options, **changes))


def test_front_is_towards_the_camera_or_along_the_heading() -> None:
    config = setup(ring(4))
    assert decisions.decided_front(config, np.zeros(3)) is None
    front = decisions.decided_front(with_options(config, front="2"), np.array([0.5, 0.9, 0.2]))
    towards = config.cameras["2"].centre - [0.5, 0.0, 0.2]
    np.testing.assert_allclose(front, [*(towards * [1, 0, 1] / np.hypot(towards[0], towards[2]))])
    for degrees, along in ((0.0, [0, 0, 1]), (90.0, [1, 0, 0]), (-90.0, [-1, 0, 0]), (180.0, [0, 0, -1])):
        headed = with_options(config, heading=np.radians(degrees))
        np.testing.assert_allclose(decisions.decided_front(headed, np.zeros(3)), along, atol=1e-12)


@pytest.mark.nightly
@pytest.mark.parametrize("turned", [0.0, 180.0])
def test_t_pose_starts_with_the_decided_one_of_both_headings(turned: float) -> None:
    """Also against the feet: the pictures show them in the other direction for 180 degrees."""
    config = with_options(setup(ring(4)), heading=YAW + np.radians(turned + 60.0))
    state, _, texts = played(config, SEED, [t_pose_at(SEED, yaw=YAW)] * (T_POSE_FRAMES + 25))
    assert state.phase.estimate.rotation[:, 2] @ ahead(YAW + np.radians(turned)) > 0.9
    assert state.phase.decided_ns is not None
    assert texts[-1] == "tracking"


@pytest.mark.nightly
@pytest.mark.parametrize("turned", [0.0, 180.0])
@pytest.mark.parametrize("height", [None, simulated_person(SEED).height])
def test_any_posture_starts_with_the_decided_one_of_both_headings(turned: float, height: float | None) -> None:
    config = with_options(setup(ring(4), height), heading=YAW + np.radians(turned))
    state, _, _ = played(config, SEED, [standing_at(SEED, 0.3, -0.2, YAW)] * (START_AFTER_NS // FRAME_NS + 6))
    assert state.phase.estimate.rotation[:, 2] @ ahead(YAW + np.radians(turned)) > 0.8
    assert state.phase.decided_ns is not None


def test_turn_exchanges_at_its_frame_set_only_and_not_where_the_track_faces_that_way() -> None:
    back = tuple((-STANDING.rotation[:, 2]).tolist())
    config = with_options(SETUP, turns=(Turn(captured_ns=7, front=back),))
    outcome = no_pose(SETUP, lost=False)
    for phase, captured_ns, is_turned in (
        (tracking(STANDING), 7, True),
        (tracking(STANDING), 8, False),
        (tracking(reversed_of(STANDING)), 7, False),
    ):
        after, _ = decisions.turned_as_decided(config, phase, outcome, captured_ns, rays_alone(rays()))
        assert (after is not phase) == is_turned
        assert decisions.faces(after.estimate, np.array(back)) == (captured_ns == 7)
        assert after.person.body is phase.person.body


def test_without_a_decision_the_first_pose_stays() -> None:
    phase, outcome = tracking(STANDING), no_pose(SETUP, lost=False)
    assert decisions.start_as_decided(SETUP, phase, outcome, 0, rays_alone(rays())) == (phase, outcome)
    assert Options().front is None
