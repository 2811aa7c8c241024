"""A pose's coordinates: round trip, and continuity where Euler angles jump."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import turn
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of, unwrap_rotations
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.services.tracker.body.average_body import average_body

COORDINATES = coordinates_of(FOURTEEN_PARTS)
seeds = st.integers(0, 10_000)


def within_limits(anatomy: Anatomy, seed: int) -> Pose:
    low, high = anatomy.limits.T
    return Pose(np.array([0.2, 0.9, -0.4]), np.random.default_rng(seed).uniform(low, high))


def frames(anatomy: Anatomy, pose: Pose) -> Floats:
    return part_frames(anatomy, average_body(anatomy, 1.7), pose)


def test_the_paper_has_nineteen_joint_angles() -> None:
    assert coordinates_of(TEN_PARTS).dimension == 19
    assert COORDINATES.dimension == len(FOURTEEN_PARTS.angles) - 3 == len(COORDINATES.names)


@each_anatomy
@given(seed=seeds)
def test_angles_of_coordinates_give_the_same_part_frames(anatomy: Anatomy, seed: int) -> None:
    pose, coordinates = within_limits(anatomy, seed), coordinates_of(anatomy)
    placed = frames(anatomy, pose)
    again = Pose(pose.position, coordinates.angles(coordinates.of_pose(pose), placed[0, :, :3].copy()))
    assert frames(anatomy, again) == pytest.approx(placed, abs=1e-9)


@each_anatomy
@given(seed=seeds)
def test_coordinates_round_trip(anatomy: Anatomy, seed: int) -> None:
    coordinates = coordinates_of(anatomy)
    values = np.random.default_rng(seed).uniform(-1.5, 1.5, coordinates.dimension)
    root = turn(np.array([0.1, 0.7, -0.2]))
    assert coordinates.of_pose(Pose(np.zeros(3), coordinates.angles(values, root))) == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("side", ["right", "left"])
def test_an_arm_that_swings_past_the_front_moves_its_coordinates_smoothly(side: str) -> None:
    """The arm's Euler angles are singular there: the second angle is 90 degrees."""
    angles = np.tile(FOURTEEN_PARTS.neutral, (81, 1))
    angles[:, FOURTEEN_PARTS.index[f"{side}_shoulder.x"]] = np.pi / 2
    angles[:, FOURTEEN_PARTS.index[f"{side}_shoulder.z"]] = np.pi + np.linspace(-0.4, 0.4, 81)
    found = [COORDINATES.of_pose(Pose(np.zeros(3), row)) for row in angles]
    steps = np.abs(np.diff(found, axis=0)).max(axis=1)
    assert steps.max() < 0.02
    assert steps.max() > 0.005


def test_rotation_vectors_past_half_a_turn_are_continuous() -> None:
    at = COORDINATES.names.index("right_shoulder.1")
    values = np.zeros((40, COORDINATES.dimension))
    turns = np.linspace(2.5, 3.9, 40)
    values[:, at] = np.where(turns > np.pi, turns - 2 * np.pi, turns)
    found = unwrap_rotations(FOURTEEN_PARTS, values)
    np.testing.assert_allclose(found[:, at], turns, atol=1e-9)
    for before, after in zip(values, found, strict=True):
        np.testing.assert_allclose(turn(before[at : at + 3]), turn(after[at : at + 3]), atol=1e-9)
