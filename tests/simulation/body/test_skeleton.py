"""The skeleton: rigid bones, planted feet, and legs that reach."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import LEFT, RIGHT, SIDES, Pelvis, Placement, Swing, compose, neutral, place
from zenocap.simulation.body.skeleton import FOOT, FOREARM, SHANK, THIGH, UPPER_ARM, pose_bones

ANGLE = st.floats(-1.0, 1.0)
REACH = st.floats(-0.15, 0.15)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(0, 30), st.tuples(REACH, REACH), st.floats(0.0, 0.35), ANGLE, ANGLE, ANGLE)
def test_bones_are_rotations_of_fixed_length(
    seed: int, shift: tuple[float, float], drop: float, yaw: float, lean: float, swing: float
) -> None:
    subject = person(seed)
    pose = neutral(subject)
    pelvis = np.array([shift[0], shift[1], drop, yaw, 0.4 * lean, 0.2 * swing])
    arms = pose.arms + np.array([[lean + 1.0, swing, yaw, 1.0 + lean], [0.5, lean, swing, 0.3]])
    pose = replace(pose, pelvis=pelvis, spine=0.3 * np.array([lean, swing, yaw]), arms=arms)
    bones, size = pose_bones(subject, pose), subject.lengths
    assert np.allclose(bones.rotation @ bones.rotation.transpose(0, 2, 1), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(bones.rotation), 1.0)
    for side in SIDES:
        for upper, lower, length in (
            (UPPER_ARM[side], FOREARM[side], size.upper_arm),
            (THIGH[side], SHANK[side], size.thigh),
            (SHANK[side], FOOT[side], size.shank),
        ):
            assert np.linalg.norm(bones.origin[upper] - bones.origin[lower]) == pytest.approx(length)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(0, 30), st.tuples(REACH, REACH), st.floats(0.0, 0.35), st.floats(-0.5, 0.5))
def test_planted_feet_do_not_move_with_the_pelvis(seed: int, shift: tuple[float, float], drop: float, yaw: float) -> None:
    subject = person(seed)
    pose = neutral(subject)
    moved = replace(pose, pelvis=np.array([shift[0], shift[1], drop, yaw, 0.1, 0.05]))
    for side in SIDES:
        before = pose_bones(subject, pose).origin[FOOT[side]]
        after = pose_bones(subject, moved).origin[FOOT[side]]
        assert np.allclose(before, after, atol=1e-3)


def test_knees_bend_forwards() -> None:
    subject = person(2)
    pose = neutral(subject)
    pose.pelvis[Pelvis.DROP] = 0.3
    bones = pose_bones(subject, pose)
    for side in SIDES:
        assert bones.origin[SHANK[side], 2] > bones.origin[THIGH[side], 2] + 0.15


def test_a_swung_leg_goes_forward_and_its_knee_bends_back() -> None:
    subject = person(2)
    swing = np.zeros((2, 3))
    swing[RIGHT, Swing.HIP], swing[RIGHT, Swing.KNEE] = 1.2, 0.8
    bones = pose_bones(subject, replace(neutral(subject), swing=swing))
    assert bones.origin[SHANK[RIGHT], 2] > 0.25
    assert bones.origin[FOOT[RIGHT], 1] > subject.lengths.ankle_height + 0.2
    shin = bones.origin[FOOT[RIGHT]] - bones.origin[SHANK[RIGHT]]
    assert shin[2] < 0.9 * (bones.origin[SHANK[RIGHT], 2] - bones.origin[THIGH[RIGHT], 2])
    assert bones.origin[FOOT[LEFT], 1] == pytest.approx(subject.lengths.ankle_height, abs=1e-3)


@settings(max_examples=40)
@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-4, 4), st.floats(-2, 2), st.floats(-2, 2), st.floats(-4, 4))
def test_two_placements_equal_their_composition(x: float, z: float, yaw: float, dx: float, dz: float, turn: float) -> None:
    subject = person(1)
    first, step = Placement(x, z, yaw), Placement(dx, dz, turn)
    twice = place(place(neutral(subject), step), first)
    once = place(neutral(subject), compose(first, step))
    assert np.allclose(twice.feet, once.feet)
    assert np.allclose(twice.pelvis, once.pelvis)


def test_placement_turns_from_z_towards_x() -> None:
    pose = neutral(person(1))
    pose.pelvis[Pelvis.Z] = 1.0
    placed = place(pose, Placement(0.0, 0.0, np.pi / 2))
    assert placed.pelvis[0] == pytest.approx(1.0)
    assert placed.pelvis[Pelvis.YAW] == pytest.approx(np.pi / 2)
