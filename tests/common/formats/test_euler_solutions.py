"""Equal Euler angles: inside the reader's ranges, continuous, from whatever pose a take begins."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.support.angle_cases import posed, track_of_angles, walking_person
from tests.support.opensim_models import hands_off, needs_opensim
from tests.support.places import ROOT
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.clinical_angles import JOINT_AXES, other_solution
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.formats.euler_solutions import NO_RANGES, continuous_euler
from zenocap.common.formats.mot import read_mot, write_mot
from zenocap.common.formats.opensim_coordinates import ARM_DEG, BEYOND_DEG, JOINTS, LONG, CoordinateTriple, coordinates_of
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.take_poses import read_poses

STEP_S = 1 / 30
ARM = [(np.radians(low), np.radians(high)) for low, high in ARM_DEG]


def found_deg(degrees: Floats, ranges: Sequence[tuple[float, float]] = ARM) -> Floats:
    """Angles chosen for the rotations of other ones, degrees."""
    return np.degrees(continuous_euler(JOINT_AXES, euler_to_matrix(JOINT_AXES, np.radians(degrees)), ranges, STEP_S))


def from_a_t_pose() -> PoseTrack:
    """A walk after a T-pose, from which the arms sink within half a second, the left one over the front."""
    walk = walking_person(FOURTEEN_PARTS, 40).angles
    start, rows = t_pose_angles(FOURTEEN_PARTS), np.linspace(0.0, 1.0, 15)[:, None]
    front = 0.9 * np.sin(np.pi * rows) * (posed(FOURTEEN_PARTS, {"left_shoulder.x": 60.0}) - FOURTEEN_PARTS.neutral)
    angles = np.concatenate([np.tile(start, (10, 1)), start + rows * (walk[0] - start) + front, walk])
    return track_of_angles(FOURTEEN_PARTS, np.zeros((len(angles), 3)), angles)


def played(triple: CoordinateTriple, columns: Mapping[str, Floats]) -> Floats:
    """Rotations (n, 3, 3) that a reader has which clamps coordinates to their ranges."""
    values = [np.clip(columns[name], *ends) for name, ends in zip(triple.names, triple.ranges_deg, strict=False)]
    signed = np.stack([sign * value for sign, value in zip(triple.signs, values, strict=False)], axis=-1)
    return euler_to_matrix(triple.axes, np.radians(signed))


def test_a_walk_after_a_t_pose_is_written_inside_the_models_ranges_and_played_as_it_was(tmp_path: Path) -> None:
    """Also read back from the file, because the other solution is the same rotation until a reader clamps it."""
    track = from_a_t_pose()
    write_mot(tmp_path / "walk.mot", *coordinates_of(track))
    columns = read_mot(tmp_path / "walk.mot").columns
    walk = slice(25, None)
    for joint in ("left_shoulder", "right_shoulder", "left_hip", "right_hip", "trunk"):
        ((triple,), *_) = JOINTS[joint]
        true = euler_to_matrix(JOINT_AXES, np.radians(np.stack([columns[n] for n in triple.names], -1) * triple.signs))
        turn = np.degrees(np.arccos(np.clip((np.einsum("nij,nij->n", true, played(triple, columns)) - 1) / 2, -1, 1)))
        assert turn[walk].max() < 1.0, joint
        assert np.abs(np.diff([columns[name][walk] for name in triple.names])).max() < 45.0, joint


@pytest.mark.slow
@needs_opensim
def test_opensim_plays_a_walk_after_a_t_pose_as_it_was(tmp_path: Path) -> None:
    write_mot(tmp_path / "walk.mot", *coordinates_of(from_a_t_pose()))
    assert hands_off(tmp_path / "walk.mot", tmp_path)[25:].max() < 0.01


@pytest.mark.parametrize("at", [0, 12, -1], ids=["in the T-pose", "while the arms sink", "at the end"])
def test_a_singular_row_decides_for_no_other(at: int) -> None:
    angles = np.tile([19.0, 6.0, 48.0], (30, 1)) + np.linspace(0.0, 8.0, 30)[:, None]
    singular = angles.copy()
    singular[at] = [70.0, -90.0, -160.0]
    np.testing.assert_allclose(np.delete(found_deg(singular), at, 0), np.delete(angles, at, 0), atol=1e-9)


@pytest.mark.parametrize(
    "angles",
    [np.array([[19.0, 6.0, 48.0]]), np.tile([19.0, 6.0, 48.0], (9, 1)), np.tile([-80.0, -118.0, 85.0], (9, 1))],
    ids=["one row", "hanging", "raised over the head sideways"],
)  # fmt: skip
def test_of_both_solutions_and_their_turns_the_one_inside_is_chosen(angles: Floats) -> None:
    for given in (angles, other_solution(angles), angles + np.array([360.0, 0.0, -360.0])):
        np.testing.assert_allclose(found_deg(given), angles, atol=1e-9)


def test_an_arm_that_leaves_its_range_for_a_moment_does_not_jump() -> None:
    angles = np.column_stack([100.0 * np.sin(np.linspace(0, np.pi, 60)), np.full(60, 10.0), np.full(60, 20.0)])
    np.testing.assert_allclose(found_deg(angles), angles, atol=1e-9)


@pytest.mark.parametrize("name", ["arms", "live"])
def test_arms_of_golden_takes_that_are_beyond_their_ranges_are_so_in_both_solutions(name: str) -> None:
    columns = coordinates_of(read_poses(ROOT / "tests" / "golden" / f"{name}.mcap").track())[1]
    for ((triple,),) in (JOINTS["left_shoulder"], JOINTS["right_shoulder"]):
        written, ends = np.stack([columns[one] for one in triple.names], -1) * triple.signs, np.degrees(triple.ranges)
        beyond = [np.maximum(ends[:, 0] - one, one - ends[:, 1]).max(axis=1) for one in (written, other_solution(written))]
        assert np.mean(beyond[0] > BEYOND_DEG) > 0.3
        assert np.mean((beyond[0] > BEYOND_DEG) & (beyond[1] <= 0.0)) < LONG


def test_a_free_angle_grows_past_a_turn_and_begins_in_the_middle() -> None:
    angles = np.column_stack([np.zeros(101), np.zeros(101), np.linspace(-400.0, 400.0, 101)])
    np.testing.assert_allclose(found_deg(angles, NO_RANGES), angles, atol=1e-9)


def test_in_gimbal_lock_the_first_angle_is_that_of_the_nearest_row() -> None:
    angles = np.array([[10.0, 89.0, 5.0], [10.0, 90.0, 5.0], [20.0, 90.0, -5.0], [20.0, 89.0, -5.0]])
    np.testing.assert_allclose(found_deg(angles, NO_RANGES), angles, atol=1e-6)
    assert found_deg(np.tile([0.0, 90.0, 30.0], (3, 1)), NO_RANGES) == pytest.approx(np.tile([0.0, 90.0, 30.0], (3, 1)))


def test_no_row_gives_no_angle() -> None:
    assert continuous_euler("zxy", np.empty((0, 3, 3)), NO_RANGES, STEP_S).shape == (0, 3)
