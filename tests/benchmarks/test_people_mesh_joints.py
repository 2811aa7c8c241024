"""Conversion to the joints of the clips' mesh: which points move, by how much, and in which frame."""

import numpy as np
import pytest

from benchmarks.people.mesh_joints import ANKLE, HEAD, HIP_HALF, in_mesh_convention
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose, neutral_pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.body.average_body import average_body

NAMES = tuple(marker.name for marker in TEN_PARTS.markers)
HEIGHT = 1.8


def track(*poses: Pose) -> Trajectories:
    body = average_body(TEN_PARTS, HEIGHT)
    points = np.array([joint_centres(TEN_PARTS, body, pose) for pose in poses])
    frames = np.arange(len(poses), dtype=np.int64)
    return Trajectories(NAMES, frames, frames / 30.0, points, 30.0)


def test_only_hips_head_ankles_and_wrists_move() -> None:
    own = track(neutral_pose(TEN_PARTS, np.zeros(3)))
    moved = np.abs(in_mesh_convention(own).points - own.points).max(axis=(0, 2)) > 1e-6
    assert {name for name, one in zip(NAMES, moved, strict=True) if one} == {
        "RHip", "LHip", "Head", "RAnkle", "LAnkle", "RWrist", "LWrist",
    }  # fmt: skip


def test_the_points_of_an_upright_person_lie_where_the_mesh_has_them() -> None:
    own = track(neutral_pose(TEN_PARTS, np.zeros(3)))
    before, after = own.points[0], in_mesh_convention(own).points[0]
    at = {name: k for k, name in enumerate(NAMES)}
    trunk = before[at["Neck"], 1] - before[at["Hip"], 1]
    assert after[at["LHip"], 0] == pytest.approx(HIP_HALF * trunk)
    np.testing.assert_allclose(after[at["Head"]] - before[at["Head"]], [0, HEAD[0] * HEIGHT, HEAD[1] * HEIGHT], atol=1e-3)
    np.testing.assert_allclose(after[at["LAnkle"]] - before[at["LAnkle"]], [0, ANKLE * HEIGHT, 0], atol=1e-4)


def test_the_conversion_turns_with_the_person_and_keeps_frames_without_a_pose() -> None:
    pose = Pose(np.array([0.3, 0.9, 0.1]), np.random.default_rng(4).uniform(*TEN_PARTS.limits.T))
    own = track(pose, pose)
    own.points[1] = np.nan
    turn = euler_to_matrix("yx", np.array([[1.1, 0.4]]))[0]
    turned = in_mesh_convention(Trajectories(NAMES, own.frames, own.times_s, own.points @ turn.T, 30.0)).points
    np.testing.assert_allclose(turned[0], in_mesh_convention(own).points[0] @ turn.T, atol=1e-9)
    assert np.isnan(turned[1]).all()
