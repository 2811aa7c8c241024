"""Start in any posture with an average body; the T-pose replaces it; persons only."""

from collections.abc import Iterable
from dataclasses import replace

import cv2
import msgspec
import numpy as np
import pytest

from tests.support.tracker_ring import FRAME_NS, rendered_masks, ring, setup, simulated_person, t_pose_at
from zenocap.common.arrays import Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Phase
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.parameters import START_AFTER_NS
from zenocap.services.tracker.states import Lost, Outcome, Setup, Tracking, TrackState
from zenocap.services.tracker.tracking import describe, initial_state, phase_of, remeasure, track
from zenocap.simulation.body.pose import PersonPose, Placement, neutral, place
from zenocap.simulation.ground_truth import truth

CAMERAS = ring(4)
SEED = 3
AFTER = START_AFTER_NS // FRAME_NS + 1  # frame sets until a track starts
STANDING = place(neutral(simulated_person(SEED)), Placement(0.3, -0.2, 0.7))


def run(
    config: Setup, poses: Iterable[PersonPose | None], state: TrackState, start: int = 0
) -> tuple[TrackState, list[Outcome]]:
    outcomes = []
    for k, pose in enumerate(poses, start):
        state, outcome = track(config, state, k * FRAME_NS, rendered_masks(CAMERAS, SEED, pose))
        outcomes.append(outcome)
    return state, outcomes


@pytest.fixture(scope="module")
def standing() -> tuple[TrackState, list[Outcome]]:
    config = setup(CAMERAS)
    return run(config, [None, *[STANDING] * (AFTER + 3)], initial_state(config))


@pytest.mark.nightly
def test_standing_person_is_tracked_with_an_average_body_within_two_seconds(
    standing: tuple[TrackState, list[Outcome]],
) -> None:
    state, outcomes = standing
    first = next(k for k, outcome in enumerate(outcomes) if outcome.pose is not None)
    assert (first - 1) * FRAME_NS < 2e9
    body, pose = outcomes[first].body, outcomes[-1].pose
    assert body is not None
    assert pose is not None
    height = simulated_person(SEED).height
    average = average_body(setup(CAMERAS).anatomy, 1.0)
    assert body.sizes[0, 0] / average.sizes[0, 0] == pytest.approx(height, rel=0.08)
    true = truth(simulated_person(SEED), STANDING)
    assert np.linalg.norm(pose.position - true.joints["Hip"]) < 0.08
    assert describe(state).startswith("tracking with average proportions: hold the T-pose to measure the body")
    assert phase_of(state) is Phase.TRACKING


@pytest.mark.nightly
def test_heading_is_that_of_the_feet(standing: tuple[TrackState, list[Outcome]]) -> None:
    state, _ = standing
    assert isinstance(state.phase, Tracking)
    assert state.phase.estimate.rotation[:, 2] @ np.array([np.sin(0.7), 0.0, np.cos(0.7)]) > 0.9


@pytest.mark.nightly
def test_t_pose_replaces_the_average_body_by_a_measured_one(standing: tuple[TrackState, list[Outcome]]) -> None:
    state, outcomes = standing
    config = setup(CAMERAS)
    state, outcomes = run(config, [t_pose_at(SEED)] * 6, state, len(outcomes))
    assert isinstance(state.phase, Tracking)
    assert state.phase.person.measuring is None
    assert "average" not in describe(state)
    assert sum(outcome.body is not None for outcome in outcomes) >= 1
    assert all(outcome.pose is not None for outcome in outcomes)  # tracking goes on while the body is measured


@pytest.mark.nightly
def test_t_pose_is_awaited_when_the_rig_or_the_user_asks_for_it() -> None:
    config = setup(CAMERAS)
    options = replace(config.options, filter=msgspec.structs.replace(config.options.filter, start="t-pose"))
    only = replace(config, options=options)
    for one, state in ((only, initial_state(only)), (config, remeasure(config))):
        after, outcomes = run(one, [STANDING] * (AFTER + 2), state)
        assert all(outcome.pose is None for outcome in outcomes)
        assert describe(after).startswith("no T-pose")


@pytest.mark.nightly
def test_person_who_leaves_before_the_start_starts_the_time_again() -> None:
    config = setup(CAMERAS)
    state, outcomes = run(config, [*[STANDING] * (AFTER - 1), None, *[STANDING] * (AFTER - 1)], initial_state(config))
    assert all(outcome.pose is None for outcome in outcomes)
    assert describe(state).startswith("no T-pose")


@pytest.mark.nightly
def test_average_body_is_kept_while_the_person_is_away(standing: tuple[TrackState, list[Outcome]]) -> None:
    state, outcomes = standing
    config = setup(CAMERAS)
    state, _ = run(config, [None] * 61, state, len(outcomes))
    assert isinstance(state.phase, Lost)
    state, back = run(config, [STANDING] * 3, state, len(outcomes) + 61)
    assert isinstance(state.phase, Tracking)
    assert state.phase.person.measuring is not None
    assert back[-1].pose is not None


def box(camera: Camera, width: float, height: float, depth: float) -> Mask:
    """Mask of a box on the floor, metres."""
    corners = np.array([[x, y, z] for x in (-width, width) for y in (0.0, 2 * height) for z in (-depth, depth)]) / 2
    mask = np.zeros(camera.size[::-1], np.uint8)
    return cv2.fillConvexPoly(mask, cv2.convexHull(np.rint(camera.project(corners)).astype(np.int32)), 1)


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(0.5, 1.2, 0.5), (0.9, 2.0, 0.05), (0.6, 1.7, 0.6)], ids=["box", "door", "wardrobe"])
@pytest.mark.parametrize("views", [2, 4])
def test_furniture_never_starts(size: tuple[float, float, float], views: int) -> None:
    cameras = ring(views)
    config = setup(cameras)
    state = initial_state(config)
    for k in range(2 * AFTER + 4):
        state, outcome = track(
            config, state, k * FRAME_NS, {viewer: box(camera, *size) for viewer, camera in cameras.items()}
        )
        assert outcome.pose is None
    assert describe(state).startswith("no T-pose")


def test_empty_room_never_starts() -> None:
    config = setup(CAMERAS)
    state, outcomes = run(config, [None] * (AFTER + 2), initial_state(config))
    assert all(outcome.pose is None for outcome in outcomes)
    assert describe(state) == "waiting for a person"


@pytest.mark.nightly
def test_clock_that_is_set_back_starts_the_time_again() -> None:
    config = setup(CAMERAS)
    state = initial_state(config)
    masks = rendered_masks(CAMERAS, SEED, STANDING)
    hour_ns = 3_600_000_000_000
    for captured_ns in (hour_ns, *(k * FRAME_NS for k in range(AFTER + 1))):
        state, outcome = track(config, state, captured_ns, masks)
    assert outcome.pose is not None
