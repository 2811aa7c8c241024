"""Preparation of motion for training."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.anatomies import each_anatomy, other_side
from tests.support.prior_cases import COORDINATES, D
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.services.tracker.prior.sequences import finite_runs, held_out, mirrored, resampled, rms_velocities


def origins(anatomy: Anatomy, values: Floats) -> Floats:
    """(parts, 3) start and end of every part of a symmetric body, root unrotated."""
    count = len(anatomy.joints)
    offsets = np.zeros((count, 3))
    for k, joint in enumerate(anatomy.joints):
        side = {"l": 1.0, "r": -1.0}.get(joint.name[0] if "_" in joint.name and joint.name != "neck_base" else "", 0.0)
        offsets[k] = (0.15 * side, 0.3, 0.02)
    angles = coordinates_of(anatomy).angles(values, np.eye(3))
    frames = part_frames(anatomy, Bdp(np.ones((count, 3)), offsets), Pose(np.zeros(3), angles))
    return np.concatenate([frames[:, :, 3], frames[:, :, 3] + frames[:, :, 1]])


@each_anatomy
@pytest.mark.parametrize("seed", range(5))
def test_mirrored_pose_is_the_body_in_a_mirror(anatomy: Anatomy, seed: int) -> None:
    coordinates = coordinates_of(anatomy)
    values = np.random.default_rng(seed).normal(scale=0.3, size=coordinates.dimension)
    order = [anatomy.index[other_side(part)] for part in anatomy.parts]
    places = origins(anatomy, values).reshape(2, -1, 3)[:, order].reshape(-1, 3)
    assert np.allclose(origins(anatomy, mirrored(coordinates, values[None])[0]), places * [-1, 1, 1], atol=1e-9)


def test_resampling_keeps_the_instants_that_both_rates_have() -> None:
    poses = np.random.default_rng(0).normal(scale=0.3, size=(61, D))
    assert np.allclose(resampled(COORDINATES, poses, 120.0, 60.0), poses[::2], atol=1e-9)
    assert np.allclose(resampled(COORDINATES, poses, 60.0, 120.0)[::2], poses, atol=1e-9)
    assert resampled(COORDINATES, poses, 120.0, 50.0).shape == (26, D)
    assert resampled(COORDINATES, poses, 60.0, 60.0) is poses


def test_between_two_poses_a_ball_joint_takes_the_shortest_turn() -> None:
    poses = np.zeros((2, D))
    poses[0, :3], poses[1, :3] = [3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]  # a small turn through pi
    middle = resampled(COORDINATES, poses, 1.0, 2.0)[1]
    assert Rotation.from_rotvec(middle[:3]).magnitude() == pytest.approx(np.pi)


def test_rotation_past_pi_is_continuous() -> None:
    poses = np.zeros((41, D))
    poses[:, 3] = np.linspace(2.5, 4.5, 41)
    assert np.allclose(resampled(COORDINATES, poses, 60.0, 90.0)[:, 3], np.linspace(2.5, 4.5, 61))


def test_runs_are_split_at_frames_without_a_pose() -> None:
    poses = np.arange(14.0).reshape(7, 2)
    poses[2, 1] = poses[5, 0] = np.nan
    assert [run[:, 0].tolist() for run in finite_runs(poses)] == [[0.0, 2.0], [6.0, 8.0], [12.0]]


@given(st.lists(st.integers(1, 700), min_size=1, max_size=5))
def test_every_frame_is_used_or_held_out(lengths: list[int]) -> None:
    ends = np.cumsum(lengths)
    sequences = [np.arange(end - n, end)[:, None].astype(float) for end, n in zip(ends, lengths, strict=True)]
    learnt, held = held_out(sequences, 60.0)
    frames = np.concatenate([*learnt, *held])[:, 0]
    assert np.array_equal(np.sort(frames), np.arange(ends[-1]))
    assert all(np.all(np.diff(part[:, 0]) == 1) for part in [*learnt, *held])


def test_a_fifth_of_a_hundred_frames_is_held_out() -> None:
    learnt, held = held_out([np.zeros((100, 2))], 60.0)
    assert (sum(map(len, learnt)), sum(map(len, held))) == (80, 20)


def test_speeds_are_root_mean_squares_per_second_within_sequences() -> None:
    sequences = [np.array([[0.0], [0.1], [0.2]]), np.array([[9.0], [9.1]])]
    assert np.allclose(rms_velocities(sequences, 60.0), [6.0])
