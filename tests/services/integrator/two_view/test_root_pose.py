"""Root pose from an assignment: tilts, turns, and the heading of the person."""

import dataclasses

import numpy as np
import pytest
from msgspec.structs import replace

from tests.support.perfect_viewers import FIRST, HIPS, SETUP, TRACKED, play, sighting
from tests.support.simulated_cameras import look
from tests.support.two_view_run import FRAME_NS, VIEWERS, envelope
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.segments import YAW_OFFSETS, limb_directions, torso_rotation
from zenocap.common.camera.level_view import level_view
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Assignment, Message
from zenocap.common.rig.two_view import PAPER, Additions
from zenocap.services.integrator.states import IntegratorState
from zenocap.services.integrator.step import step


def place(state: IntegratorState, *messages: Message) -> tuple[IntegratorState, Assignment]:
    state, (assignment,) = play(state, *messages)
    return state, assignment


def tilted(one: float, two: float) -> Assignment:
    """The assignment after both viewers have seen a tilt, radians."""
    tilts = dict(zip(VIEWERS, (one, two), strict=True))
    return place(TRACKED, *(replace(sighting(viewer, FIRST), tilt=tilt) for viewer, tilt in tilts.items()))[1]


def yaw_off(a: float, b: float) -> float:
    return abs((a - b + np.pi) % (2 * np.pi) - np.pi)


def test_the_torso_is_unchanged_without_tilts_and_turns() -> None:
    assignment = tilted(0.0, 0.0)
    assert (assignment.yaw, assignment.lean, assignment.roll) == pytest.approx((0.0, 0.0, 0.0), abs=1e-2)
    assert not assignment.squatting


@pytest.mark.parametrize(("tilts", "lean", "roll"), [((0.0, 0.2), 0.2, 0.0), ((0.2, 0.0), 0.0, -0.2)])
def test_the_flanks_tilt_is_a_lean_and_the_facades_a_roll(tilts: tuple[float, float], lean: float, roll: float) -> None:
    """A turn about the view's axis, which runs from the camera to the person: about +X, forward, and about -Z."""
    assignment = tilted(*tilts)
    assert (assignment.lean, assignment.roll) == pytest.approx((lean, roll), abs=0.02)


def test_the_torso_stays_within_its_limits() -> None:
    assignment = tilted(1.4, -1.4)
    for angle, axis in ((assignment.lean, "x"), (assignment.roll, "z")):
        low, high = TEN_PARTS.limits[TEN_PARTS.index[f"navel.{axis}"]]
        assert low <= angle <= high


@pytest.mark.parametrize("sign", [-1, 1])
def test_turns_observed_by_both_viewers_turn_the_body(sign: int) -> None:
    profile = (-60.0 * (YAW_OFFSETS - sign * np.radians(8)) ** 2).tolist()
    _, assignment = place(TRACKED, *(replace(sighting(v, FIRST), turns=profile) for v in VIEWERS))
    assert np.sign(assignment.yaw) == sign
    assert abs(assignment.yaw) < np.radians(16)


@pytest.mark.parametrize(("lowered_m", "squatting"), [(0.07, False), (0.3, True)])
def test_a_lowered_navel_on_straight_legs_is_not_squatting_and_a_low_one_is(lowered_m: float, squatting: bool) -> None:
    _, assignment = place(TRACKED, *(sighting(v, FIRST, HIPS - [0, lowered_m, 0]) for v in VIEWERS))
    assert assignment.squatting is squatting


def walk(state: IntegratorState, step: Floats, frames: int) -> tuple[IntegratorState, list[Assignment]]:
    assignments = []
    for k in range(frames):
        at = HIPS + (k + 1) * step
        state, assignment = place(state, *(sighting(v, FIRST + k, at) for v in VIEWERS))
        assignments.append(assignment)
    return state, assignments


@pytest.mark.parametrize("apart", [89.9, 90.0, 90.1])
@pytest.mark.parametrize("additions", [PAPER, PAPER | {"turn"}], ids=["paper", "turn"])
@pytest.mark.parametrize("back", [False, True])
def test_after_a_right_turn_the_person_faces_the_new_facade_viewer(apart: float, additions: Additions, back: bool) -> None:
    """Front and back are equally far, so that rounding or a tenth of a degree must not decide."""
    side = np.radians(-apart)
    cameras = {"1": look_level(0.0), "2": look_level(side)}
    setup = dataclasses.replace(SETUP, additions=additions, cameras=cameras)
    state = TRACKED
    if back:
        angles = TRACKED.person.pose.angles.copy()
        angles[TEN_PARTS.index["navel.y"]] = np.pi
        state = dataclasses.replace(state, person=dataclasses.replace(TRACKED.person, pose=Pose(HIPS, angles)))
    for frame in range(FIRST, FIRST + 3):
        for viewer in VIEWERS:
            state, _ = step(setup, state, envelope(sighting(viewer, frame)))
    assert yaw_off(state.person.placed[-1].yaw, np.pi if back else 0.0) < 0.02  # an unchanged view keeps the back turned
    for frame in range(FIRST + 3, FIRST + 13):
        for viewer, view in zip(VIEWERS, ("flank", "facade"), strict=True):
            state, _ = step(setup, state, envelope(sighting(viewer, frame, view=view)))
    assert state.views == {"1": "flank", "2": "facade"}
    assert yaw_off(state.person.placed[-1].yaw, side) < 0.02


def look_level(angle: float) -> Camera:
    """Level camera 5.2 m from the middle of the ground."""
    centre = np.array([5.2 * np.sin(angle), 1.0, 5.2 * np.cos(angle)])
    return level_view(look("a", centre, np.array([0.0, 1.0, 0.0]))).camera


METRES = 1.2 * FRAME_NS / 1e9  # in a frame


def test_the_heading_is_reversed_after_walking_far_backwards() -> None:
    """A silhouette does not distinguish front from back; people walk forwards."""
    state, assignments = walk(TRACKED, np.array([0.0, 0.0, -METRES]), 16)
    assert yaw_off(assignments[0].yaw, 0.0) < 0.2
    assert yaw_off(assignments[-1].yaw, np.pi) < 0.5
    before, after = TRACKED.person.pose.angles, state.person.pose.angles
    here, there = (
        limb_directions(TEN_PARTS, angles) @ torso_rotation(yaw, 0.0, 0.0).T
        for angles, yaw in ((before, 0.0), (after, float(after[TEN_PARTS.index["navel.y"]])))
    )
    np.testing.assert_allclose(there, here[[1, 0, 3, 2]], atol=0.05)  # the same body in the world, left and right exchanged


@pytest.mark.parametrize("step", [(0.0, 0.0, METRES), (0.0, 0.0, 0.0), (METRES, 0.0, 0.0)], ids=["on", "none", "sideways"])
def test_the_heading_is_kept_while_walking_forwards_or_standing(step: tuple[float, float, float]) -> None:
    _, assignments = walk(TRACKED, np.array(step), 16)
    assert all(yaw_off(assignment.yaw, 0.0) < 0.5 for assignment in assignments)


def test_the_depth_is_kept_with_a_single_viewer() -> None:
    camera, last = SETUP.cameras["1"], TRACKED.person.pose.position
    _, (assignment,) = play(TRACKED, sighting("1", FIRST, HIPS + np.array([0.1, 0.0, 0.0])), sighting("1", FIRST + 1, HIPS))
    depth = camera.rotation[2] @ np.array(assignment.position)
    assert depth == pytest.approx(camera.rotation[2] @ last)
    assert assignment.position[0] == pytest.approx(HIPS[0] + 0.1, abs=1e-6)
