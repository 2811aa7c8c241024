"""Frames and quaternions against the kinematics and against their definitions."""

import foxglove.messages as fox
import numpy as np
from foxglove_reader import parsed, turn, xyz
from google.protobuf.message import Message
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation
from two_view_scene import ANGLES, BDP

from common.body.anatomy import TEN_PARTS, Floats
from common.body.definition import Pose
from common.body.kinematics import part_frames
from common.body.quaternions import quaternions
from common.formats.foxglove.channels import FIXED
from common.formats.foxglove.frames import body_transforms, fixed_transforms, timestamp
from common.messages import CameraInfo

UNIT = arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1)
POSITIONS = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def read_back(transforms: list[fox.FrameTransform]) -> list[Message]:
    return list(parsed(FIXED.channel(rig="r"), fox.FrameTransforms(transforms=transforms).encode()).transforms)


@given(UNIT)
def test_a_quaternion_says_the_rotation_it_came_from(q: Floats) -> None:
    rotation = Rotation.from_quat(q).as_matrix()
    found = quaternions(rotation[None])[0]
    np.testing.assert_allclose(Rotation.from_quat(found).as_matrix(), rotation, atol=1e-12)
    assert abs(np.linalg.norm(found) - 1) < 1e-12


def test_half_turns_have_quaternions_too() -> None:
    halves = np.stack([np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1]), np.eye(3)])
    np.testing.assert_allclose(quaternions(halves), np.eye(4), atol=1e-15)


@given(ANGLES, POSITIONS)
def test_the_tree_composed_is_where_the_kinematics_put_every_part(angles: Floats, position: Floats) -> None:
    part_to_world = part_frames(TEN_PARTS, BDP, Pose(position, angles))
    placed = {"world": np.eye(4)}
    for transform in read_back(body_transforms(TEN_PARTS, BDP.offsets, part_to_world, timestamp(5))):
        child_to_parent = np.eye(4)
        child_to_parent[:3, :3], child_to_parent[:3, 3] = turn(transform.rotation), xyz(transform.translation)
        placed[transform.child_frame_id] = placed[transform.parent_frame_id] @ child_to_parent
    for part, expected in zip(TEN_PARTS.parts, part_to_world, strict=True):
        np.testing.assert_allclose(placed[part][:3], expected, atol=1e-9)


def test_the_world_stands_upright_in_the_root_frame() -> None:
    (world,) = read_back(fixed_transforms([], timestamp(0)))
    assert (world.parent_frame_id, world.child_frame_id) == ("map", "world")
    np.testing.assert_allclose(turn(world.rotation), [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)
    np.testing.assert_array_equal(xyz(world.translation), 0)


@given(UNIT, POSITIONS)
def test_a_cameras_frame_undoes_its_projection(q: Floats, translation: Floats) -> None:
    """x_camera = R x_world + t, so the frame's transform takes x_camera back to x_world."""
    rotation = Rotation.from_quat(q).as_matrix()
    info = CameraInfo(
        frame=0, captured_ns=0, viewer="7", name="cam", size=(4, 4), matrix=[1.0] * 9, distortions=[],
        rotation=rotation.ravel().tolist(), translation=translation.tolist(),
    )  # fmt: skip
    camera = read_back(fixed_transforms([info], timestamp(0)))[1]
    assert (camera.parent_frame_id, camera.child_frame_id) == ("world", "viewer/7")
    point = np.array([0.3, -1.2, 2.0])
    seen = rotation @ point + translation
    np.testing.assert_allclose(turn(camera.rotation) @ seen + xyz(camera.translation), point, atol=1e-9)
