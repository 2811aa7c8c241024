"""The user's decision: a direction at the start, also against the feet; front and back later."""

from dataclasses import replace

import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import SETUP, STANDING, rays, reversed_of, tracking
from tests.support.tracker_ring import FRAME_NS, ahead, played, ring, setup, simulated_person, standing_at, t_pose_at
from tests.support.tracker_scenes import rays_alone, turn
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.filter.filter_step import no_pose
from zenocap.services.tracker.initialization import decisions
from zenocap.services.tracker.initialization.postures import turned_start
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
@pytest.mark.parametrize(("views", "turned"), [(2, 0.0), (4, 0.0), (4, 180.0)])
@pytest.mark.parametrize("height", [None, simulated_person(SEED).height])
def test_any_posture_starts_with_the_decided_one_of_both_headings(views: int, turned: float, height: float | None) -> None:
    config = with_options(setup(ring(views), height), heading=YAW + np.radians(turned))
    state, outcomes, _ = played(config, SEED, [standing_at(SEED, 0.3, -0.2, YAW)] * (START_AFTER_NS // FRAME_NS + 6))
    first = next(outcome.pose for outcome in outcomes if outcome.pose is not None)
    assert np.cos(first.angles[FOURTEEN_PARTS.index["navel.y"]] - YAW - np.radians(turned)) > 0.8
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


@pytest.mark.parametrize(("decision", "most"), [({}, 180), ({"heading": 0.0}, 60), ({"front": "1"}, 90)])
def test_decision_allows_headings_on_both_sides_of_its_direction(decision: dict[str, object], most: int) -> None:
    """The first camera is along +Z."""
    config, upright = with_options(SETUP, **decision), STANDING._replace(rotation=np.eye(3))
    for degrees in (0, 59, 61, 89, 91, 179):
        for side in (1, -1):
            pose = turned_start(upright, np.zeros(3), np.radians(side * degrees))
            assert decisions.allowed(config, pose) == (degrees < most)


@pytest.mark.parametrize("lean", [-90.0, -45.0, 0.0, 45.0, 90.0])
def test_heading_of_one_who_lies_is_that_before_leaning(lean: float) -> None:
    lying = turned_start(STANDING._replace(rotation=turn([np.radians(lean), 0.0, 0.0])), np.zeros(3), YAW)
    np.testing.assert_allclose(decisions.heading_of(lying), ahead(YAW), atol=1e-12)


def test_without_a_decision_the_track_stays() -> None:
    phase = tracking(STANDING)
    assert decisions.started(SETUP, phase, 0) is phase
    assert Options().front is None
