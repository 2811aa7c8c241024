"""Root pose from an assignment: tilts, turns, and the heading of the person."""

import numpy as np
import pytest

from tests.support.perfect_viewers import FIRST, HIPS, SETUP, TRACKED, sighting
from tests.support.two_view_run import FRAME_NS, VIEWERS, envelope
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import YAW_OFFSETS, limb_directions, torso_rotation
from zenocap.common.messages import Assignment, Message, Sighting
from zenocap.services.integrator import step as integrator
from zenocap.services.integrator.states import IntegratorState


def changed(message: Sighting, **fields: object) -> Sighting:
    return Sighting(**{name: getattr(message, name) for name in message.__struct_fields__} | fields)


def place(state: IntegratorState, *messages: Message) -> tuple[IntegratorState, Assignment]:
    published: list[Message] = []
    for message in messages:
        state, more = integrator.step(SETUP, state, envelope(message))
        published += more
    (assignment,) = published
    assert isinstance(assignment, Assignment)
    return state, assignment


def yaw_off(a: float, b: float) -> float:
    return abs((a - b + np.pi) % (2 * np.pi) - np.pi)


def test_the_torso_is_unchanged_without_tilts_and_turns() -> None:
    _, assignment = place(TRACKED, *(sighting(v, FIRST) for v in VIEWERS))
    assert (assignment.yaw, assignment.lean, assignment.roll) == pytest.approx((0.0, 0.0, 0.0), abs=1e-2)
    assert not assignment.squatting


def test_the_flanks_tilt_is_a_lean_and_the_facades_a_roll() -> None:
    """A turn about the view's axis, which runs from the camera to the person."""
    _, lean = place(TRACKED, sighting("1", FIRST), changed(sighting("2", FIRST), tilt=0.2))
    assert lean.lean == pytest.approx(0.2, abs=0.02)  # about +X: forward
    assert abs(lean.roll) < 0.02
    _, roll = place(TRACKED, changed(sighting("1", FIRST), tilt=0.2), sighting("2", FIRST))
    assert roll.roll == pytest.approx(-0.2, abs=0.02)  # about -Z
    assert abs(roll.lean) < 0.02


def test_the_torso_stays_within_its_limits() -> None:
    _, assignment = place(TRACKED, changed(sighting("1", FIRST), tilt=1.4), changed(sighting("2", FIRST), tilt=-1.4))
    limits = TEN_PARTS.limits
    assert limits[TEN_PARTS.index["navel.x"], 0] <= assignment.lean <= limits[TEN_PARTS.index["navel.x"], 1]
    assert limits[TEN_PARTS.index["navel.z"], 0] <= assignment.roll <= limits[TEN_PARTS.index["navel.z"], 1]


@pytest.mark.parametrize("sign", [-1, 1])
def test_turns_observed_by_both_viewers_turn_the_body(sign: int) -> None:
    profile = (-60.0 * (YAW_OFFSETS - sign * np.radians(8)) ** 2).tolist()
    _, assignment = place(TRACKED, *(changed(sighting(v, FIRST), turns=profile) for v in VIEWERS))
    assert np.sign(assignment.yaw) == sign
    assert abs(assignment.yaw) < np.radians(16)


def test_a_lowered_navel_on_straight_legs_is_not_squatting_and_a_low_one_is() -> None:
    _, little = place(TRACKED, *(sighting(v, FIRST, HIPS - [0, 0.07, 0]) for v in VIEWERS))
    assert not little.squatting
    _, low = place(TRACKED, *(sighting(v, FIRST, HIPS - [0, 0.3, 0]) for v in VIEWERS))
    assert low.squatting


def walk(state: IntegratorState, step: Floats, frames: int) -> tuple[IntegratorState, list[Assignment]]:
    assignments = []
    for k in range(frames):
        at = HIPS + (k + 1) * step
        state, assignment = place(state, *(sighting(v, FIRST + k, at) for v in VIEWERS))
        assignments.append(assignment)
    return state, assignments


def test_the_heading_is_reversed_after_walking_far_backwards() -> None:
    """A silhouette does not distinguish front from back; people walk forwards."""
    metres = 1.2 * FRAME_NS / 1e9
    before = TRACKED.person
    assert before is not None
    state, assignments = walk(TRACKED, np.array([0.0, 0.0, -metres]), 16)
    assert yaw_off(assignments[0].yaw, 0.0) < 0.2
    assert yaw_off(assignments[-1].yaw, np.pi) < 0.5
    assert state.person is not None
    here, there = (
        limb_directions(TEN_PARTS, person.pose.angles) @ torso_rotation(yaw, 0.0, 0.0).T
        for person, yaw in ((before, 0.0), (state.person, float(state.person.pose.angles[TEN_PARTS.index["navel.y"]])))
    )
    np.testing.assert_allclose(there, here[[1, 0, 3, 2]], atol=0.05)  # the same body in the world, left and right exchanged


def test_the_heading_is_kept_while_walking_forwards_or_standing() -> None:
    metres = 1.2 * FRAME_NS / 1e9
    for step in (np.array([0.0, 0.0, metres]), np.zeros(3), np.array([metres, 0.0, 0.0])):
        _, assignments = walk(TRACKED, step, 16)
        assert all(yaw_off(assignment.yaw, 0.0) < 0.5 for assignment in assignments)


def test_the_depth_is_kept_with_a_single_viewer() -> None:
    previous_position = TRACKED.person.pose.position if TRACKED.person else HIPS
    state, _ = integrator.step(SETUP, TRACKED, envelope(sighting("1", FIRST, HIPS + np.array([0.1, 0.0, 0.0]))))
    _, published = integrator.step(SETUP, state, envelope(sighting("1", FIRST + 1, HIPS)))
    (assignment,) = published
    assert isinstance(assignment, Assignment)
    camera = SETUP.cameras["1"]
    depth = camera.rotation[2] @ np.array(assignment.position) + camera.translation[2]
    assert depth == pytest.approx(camera.rotation[2] @ previous_position + camera.translation[2])
    assert assignment.position[0] == pytest.approx(HIPS[0] + 0.1, abs=1e-6)
