"""Start in any posture with an average body; the T-pose replaces it; persons only."""

from collections.abc import Iterable
from dataclasses import replace

import cv2
import msgspec
import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import STANDING as STRETCHED
from tests.services.tracker.initialization.test_heading import rays, reversed_of
from tests.support import tracker_ring
from tests.support.floor_people import on_floor
from tests.support.tracker_scenes import MODEL, STATURE_M, rays_alone, tangent_rays
from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Phase
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.initialization import any_posture
from zenocap.services.tracker.initialization.postures import floor_postures, floor_start
from zenocap.services.tracker.parameters import FLOOR_STATURES_M, START_AFTER_NS
from zenocap.services.tracker.states import HEADING_KINDS, AwaitingPerson, Lost, Outcome, Tracking, TrackState, refuted
from zenocap.services.tracker.tracking import describe, initial_state, phase_of, remeasure, track
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.body.skeleton import Bones

SETUP = tracker_ring.setup(tracker_ring.ring(4))
SEED = 3
AFTER = START_AFTER_NS // tracker_ring.FRAME_NS + 1  # frame sets until a track starts
STANDING = tracker_ring.standing_at(SEED, 0.3, -0.2, 0.7)
Played = tuple[TrackState, list[Outcome], list[str]]


def run(poses: Iterable[PersonPose | Bones | None], state: TrackState | None = None, start: int = 0) -> Played:
    return tracker_ring.played(SETUP, SEED, poses, state, start)


@pytest.fixture(scope="module")
def standing() -> Played:
    return run([None, *[STANDING] * (AFTER + 3)])


@pytest.mark.nightly
def test_standing_person_is_tracked_with_an_average_body_within_two_seconds(standing: Played) -> None:
    state, outcomes, texts = standing
    first = next(k for k, outcome in enumerate(outcomes) if outcome.pose is not None)
    assert (first - 1) * tracker_ring.FRAME_NS < 2e9
    of_1_m = average_body(SETUP.anatomy, 1.0)
    height = outcomes[first].body.sizes[0, 0] / of_1_m.sizes[0, 0]
    assert height == pytest.approx(tracker_ring.simulated_person(SEED).height, rel=0.08)
    assert tracker_ring.hip_error(SEED, outcomes[-1].pose.position, STANDING) < 0.08
    assert texts[-1].startswith("tracking with average proportions: hold the T-pose to measure the body")
    assert phase_of(state) is Phase.TRACKING


@pytest.mark.nightly
def test_heading_is_that_of_the_feet(standing: Played) -> None:
    assert standing[0].phase.estimate.rotation[:, 2] @ tracker_ring.ahead(0.7) > 0.9


@pytest.mark.nightly
def test_t_pose_replaces_the_average_body_by_a_measured_one(standing: Played) -> None:
    state, outcomes, _ = standing
    state, outcomes, texts = run([tracker_ring.t_pose_at(SEED)] * 6, state, len(outcomes))
    assert state.phase.person.measuring is None
    assert "average" not in texts[-1]
    assert sum(outcome.body is not None for outcome in outcomes) >= 1
    assert all(outcome.pose is not None for outcome in outcomes)  # tracking goes on while the body is measured


@pytest.mark.nightly
def test_t_pose_is_awaited_when_the_rig_or_the_user_asks_for_it() -> None:
    only_t_pose = msgspec.structs.replace(SETUP.options.filter, start="t-pose")
    only = replace(SETUP, options=replace(SETUP.options, filter=only_t_pose))
    for one, state in ((only, None), (SETUP, remeasure(SETUP))):
        _, outcomes, texts = tracker_ring.played(one, SEED, [STANDING] * (AFTER + 2), state)
        assert all(outcome.pose is None for outcome in outcomes)
        assert texts[-1].startswith("no T-pose")


@pytest.mark.nightly
def test_person_who_leaves_before_the_start_starts_the_time_again() -> None:
    _, outcomes, texts = run([*[STANDING] * (AFTER - 1), None, *[STANDING] * (AFTER - 1)])
    assert all(outcome.pose is None for outcome in outcomes)
    assert texts[-1].startswith("no T-pose")


@pytest.mark.nightly
def test_average_body_is_kept_while_the_person_is_away(standing: Played) -> None:
    state, outcomes, _ = standing
    state, _, _ = run([None] * 61, state, len(outcomes))
    assert isinstance(state.phase, Lost)
    state, back, _ = run([STANDING] * 3, state, len(outcomes) + 61)
    assert isinstance(state.phase, Tracking)
    assert state.phase.person.measuring is not None
    assert back[-1].pose is not None


@pytest.mark.parametrize("heading", [None, 0.5 + np.pi])
def test_search_that_finds_the_opposite_heading_starts_with_that_of_the_feet_unless_the_user_has_decided(
    heading: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The feet are exact, so that the opposite heading is no rival."""
    wrong = reversed_of(STRETCHED)
    monkeypatch.setattr(any_posture, "poses_anywhere", lambda *_, on_floor: [wrong])
    config = replace(SETUP, options=replace(SETUP.options, heading=heading))
    waited = AwaitingPerson(heights=((0, STATURE_M),))
    phase, outcome = any_posture.start_in_any_posture(config, waited, START_AFTER_NS, rays_alone(rays()))
    assert (phase.estimate.rotation[:, 2] @ STRETCHED.rotation[:, 2] > 0.9) == (heading is None)
    assert phase.person.heading_known == (heading is not None)
    assert outcome.body is phase.person.body
    assert phase.rivals == (() if heading is None else refuted(*HEADING_KINDS))


@pytest.mark.parametrize(("appeared", "moved_m", "sought"), [(False, 0.0, False), (True, 0.0, True), (False, 0.1, True)])
def test_what_is_low_is_sought_on_the_floor_once_it_has_moved_or_come_into_view(
    appeared: bool, moved_m: float, sought: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[bool] = []
    monkeypatch.setattr(any_posture, "poses_anywhere", lambda *_, on_floor: tried.append(on_floor) or [])
    lying, phase = floor_postures(FOURTEEN_PARTS, MODEL, 0.3, 1)[0], AwaitingPerson(appeared=appeared)
    seen = [rays_alone(tangent_rays(MODEL, floor_start(lying, np.array([x, 0.0, 0.2]), 0.4), 300)) for x in (0.0, moved_m)]
    for k in range(AFTER + 10):
        phase, _ = any_posture.start_in_any_posture(SETUP, phase, k * tracker_ring.FRAME_NS, seen[k > AFTER // 2])
    assert tried == [True] * len(FLOOR_STATURES_M) * sought


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["crouching", "sitting", "on the back", "on the front", "on the side"])
def test_person_on_the_floor_is_tracked_within_two_seconds(name: str) -> None:
    pose = on_floor(tracker_ring.simulated_person(SEED), name, 0.7)
    _, outcomes, _ = run([None, *[pose] * 70])
    first = next(k for k, outcome in enumerate(outcomes) if outcome.pose is not None)
    assert (first - 1) * tracker_ring.FRAME_NS < 2e9
    assert tracker_ring.hip_error(SEED, outcomes[-1].pose.position, pose) < 0.12


def block(width: float, height: float, depth: float, z: float = 0.0) -> Floats:
    """Corners on the floor, metres."""
    return np.array([[x, y, z + w] for x in (-width, width) for y in (0.0, 2 * height) for w in (-depth, depth)]) / 2


def ball(radius: float) -> Floats:
    directions = np.random.default_rng(0).normal(size=(500, 3))
    return radius * (directions / np.linalg.norm(directions, axis=1, keepdims=True) + [0.0, 1.0, 0.0])


FURNITURE = {
    "box": [block(0.5, 1.2, 0.5)],
    "door": [block(0.9, 2.0, 0.05)],
    "wardrobe": [block(0.6, 1.7, 0.6)],
    "sofa": [block(1.8, 0.45, 0.9), block(1.8, 0.9, 0.2, -0.7)],
    "ball": [ball(0.3)],
}


def mask_of(camera: Camera, parts: list[Floats]) -> Mask:
    """Mask of convex parts (n, 3)."""
    mask = np.zeros(camera.size[::-1], np.uint8)
    for points in parts:
        cv2.fillConvexPoly(mask, cv2.convexHull(np.rint(camera.project(points)).astype(np.int32)), 1)
    return mask


@pytest.mark.nightly
@pytest.mark.parametrize("name", FURNITURE)
@pytest.mark.parametrize("views", [2, 4])
def test_furniture_never_starts(name: str, views: int) -> None:
    """Also where it comes into view."""
    config = tracker_ring.setup(tracker_ring.ring(views))
    state, masks = initial_state(config), {id: mask_of(camera, FURNITURE[name]) for id, camera in config.cameras.items()}
    state, _ = track(config, state, 0, tracker_ring.rendered_masks(config.cameras, SEED, None))
    for k in range(1, 2 * AFTER + 4):
        state, outcome = track(config, state, k * tracker_ring.FRAME_NS, masks)
        assert outcome.pose is None
    assert describe(state).startswith(("no T-pose", "an object"))


def test_empty_room_never_starts() -> None:
    _, outcomes, texts = run([None] * (AFTER + 2))
    assert all(outcome.pose is None for outcome in outcomes)
    assert texts[-1] == "waiting for a person"


@pytest.mark.nightly
def test_clock_that_is_set_back_starts_the_time_again() -> None:
    state, masks = initial_state(SETUP), tracker_ring.rendered_masks(SETUP.cameras, SEED, STANDING)
    hour_ns = 3_600_000_000_000
    for captured_ns in (hour_ns, *(k * tracker_ring.FRAME_NS for k in range(AFTER + 1))):
        state, outcome = track(SETUP, state, captured_ns, masks)
    assert outcome.pose is not None
