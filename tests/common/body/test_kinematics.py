"""The transforms of [Two-view 2.2] against plain matrix products."""

from functools import reduce

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.two_view_scene import ANGLES, BDP, NAVEL, angles
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose, neutral_pose
from zenocap.common.body.kinematics import end_ellipses, joint_centres, part_frames

INDEX = TEN_PARTS.index
MARKERS = {marker.name: k for k, marker in enumerate(TEN_PARTS.markers)}
POSITIONS = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def translation(offset: Floats) -> Floats:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def rotation(axis: str, a: float) -> Floats:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler(axis, a).as_matrix()
    return matrix


def oracle(pose: Pose) -> dict[str, Floats]:
    """Part to world of every part as 4 x 4 products, straight from the paper: M_W^N, M_N^S = T Rz Rx Ry, M_S^F = T Rx."""

    def to_parent(joint: str, offset: Floats, axes: str) -> Floats:
        turns = [rotation(axis, float(pose.angles[INDEX[f"{joint}.{axis}"]])) for axis in axes]
        return reduce(np.matmul, [translation(offset), *turns])

    frames = {"torso": to_parent("navel", pose.position, "yxz")}
    for joint, offset in zip(TEN_PARTS.joints[1:], BDP.offsets[1:], strict=True):
        axes = "x" if "elbow" in joint.name or "knee" in joint.name else "zxy"
        frames[joint.part] = frames[joint.parent] @ to_parent(joint.name, offset, axes)
    return frames


@pytest.mark.slow
@given(POSITIONS, ANGLES)
def test_part_frames_equal_the_papers_transforms(position: Floats, pose_angles: Floats) -> None:
    pose = Pose(position, pose_angles)
    found = part_frames(TEN_PARTS, BDP, pose)
    for part, expected in oracle(pose).items():
        np.testing.assert_allclose(found[INDEX[part]], expected[:3], atol=1e-12, err_msg=part)


DIRECTIONS = {
    "right arm sideways": ("right_upper_arm", {"right_shoulder_z": 90}, [-1, 0, 0]),
    "left arm sideways": ("left_upper_arm", {"left_shoulder_z": 270}, [1, 0, 0]),
    "right arm hangs": ("right_upper_arm", {}, [0, -1, 0]),
    "left arm hangs": ("left_upper_arm", {}, [0, -1, 0]),
    "arm to the front": ("right_upper_arm", {"right_shoulder_x": 90}, [0, 0, 1]),
    "knee bends back": ("right_lower_leg", {"right_knee_x": -60}, [0, -0.5, -(0.75**0.5)]),
    "elbow bends forward": ("right_lower_arm", {"right_elbow_x": 60}, [0, -0.5, 0.75**0.5]),
}


@pytest.mark.parametrize(("part", "changes", "direction"), DIRECTIONS.values(), ids=DIRECTIONS)
def test_an_angle_turns_a_part(part: str, changes: dict[str, float], direction: list[float]) -> None:
    frames = part_frames(TEN_PARTS, BDP, Pose(NAVEL, angles(**changes)))
    np.testing.assert_allclose(frames[INDEX[part], :, 1], direction, atol=1e-12)


def test_the_neutral_pose_has_the_given_yaw_from_z_towards_x_and_does_not_modify_the_anatomy() -> None:
    before = TEN_PARTS.neutral.copy()
    pose = neutral_pose(TEN_PARTS, np.array([1, 2, 3]), yaw=np.pi / 2)
    assert pose.angles[INDEX["navel.y"]] == np.pi / 2
    np.testing.assert_allclose(part_frames(TEN_PARTS, BDP, pose)[INDEX["torso"], :, 2], [1, 0, 0], atol=1e-12)
    assert pose.position.dtype == np.float64
    np.testing.assert_array_equal(pose.position, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(TEN_PARTS.neutral, before)


def test_joint_centres_of_the_upright_person() -> None:
    centres = joint_centres(TEN_PARTS, BDP, neutral_pose(TEN_PARTS, NAVEL))
    at = {name: centres[k] for name, k in MARKERS.items()}
    np.testing.assert_allclose(at["Hip"], NAVEL)
    np.testing.assert_allclose(at["Neck"], (at["RShoulder"] + at["LShoulder"]) / 2)
    np.testing.assert_allclose(at["RHip"], NAVEL + BDP.offsets[INDEX["right_hip"]])
    assert at["RShoulder"][0] < 0 < at["LShoulder"][0]
    height = BDP.sizes[INDEX["right_upper_leg"], 0]
    np.testing.assert_allclose(at["RKnee"], at["RHip"] - [0, height, 0])
    assert at["Head"][1] > at["Neck"][1] > at["Hip"][1] > at["RKnee"][1] > at["RAnkle"][1] > 0


@pytest.mark.slow
@given(ANGLES)
def test_segments_keep_their_length_in_every_pose(pose_angles: Floats) -> None:
    centres = joint_centres(TEN_PARTS, BDP, Pose(NAVEL, pose_angles))
    for start, end, part, share in (
        ("RShoulder", "RElbow", "right_upper_arm", 1.0),
        ("LKnee", "LAnkle", "left_lower_leg", TEN_PARTS.markers[MARKERS["LAnkle"]].along),
        ("RElbow", "RWrist", "right_lower_arm", TEN_PARTS.markers[MARKERS["RWrist"]].along),
    ):
        length = np.linalg.norm(centres[MARKERS[end]] - centres[MARKERS[start]])
        np.testing.assert_allclose(length, share * BDP.sizes[INDEX[part], 0])


UPRIGHT = np.eye(3, 4)
SIZE = np.array([0.5, 0.2, 0.1])


def test_a_cylinder_has_two_equal_ends_its_height_apart() -> None:
    near, far = np.split(end_ellipses(UPRIGHT, SIZE, 12), 2)
    np.testing.assert_allclose(far - near, np.tile([0.0, 0.5, 0.0], (12, 1)), atol=1e-12)
    np.testing.assert_allclose((near[:, 0] / 0.2) ** 2 + (near[:, 2] / 0.1) ** 2, 1.0)


def test_a_cone_has_its_tips_radii_at_the_far_end() -> None:
    _, far = np.split(end_ellipses(UPRIGHT, SIZE, 12, tip=np.array([0.05, 0.04])), 2)
    np.testing.assert_allclose((far[:, 0] / 0.05) ** 2 + (far[:, 2] / 0.04) ** 2, 1.0)
    np.testing.assert_allclose(far[:, 1], 0.5)


def test_a_base_moves_the_part_in_its_own_frame() -> None:
    turned = np.array([[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0]])
    base = np.array([0.1, 0.0, 0.0])
    moved = end_ellipses(turned, SIZE, base=base) - end_ellipses(turned, SIZE)
    np.testing.assert_allclose(moved, np.tile([0.0, 0.1, 0.0], (48, 1)), atol=1e-12)
