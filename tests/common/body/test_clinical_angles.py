"""Joint angles in degrees: signs, symmetry, agreement with joint centres and with another library."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.common.body.test_inverse_kinematics import body, named_centres, random_pose
from tests.support.anatomies import each_anatomy, mirrored
from tests.support.angle_cases import posed
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.clinical_angles import (
    ANGLES,
    FROM_LOCK_DEG,
    LEAST_FLEXION_DEG,
    cardan_angles,
    clinical_angles,
    joint_rotations,
    with_rigid_trunk,
)
from zenocap.common.body.definition import Pose
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.body.rotations import unit

BENT_KNEES = {"right_knee.x": -30.0, "left_knee.x": -30.0}
LATERAL = ("pelvis_obliquity", "trunk_lateral_lean", "trunk_bending", "trunk_rotation", "neck_bending")  # signed by side
# Change of the model's joint angles, and the clinical angles of the right side that follow; all others stay 0.
CASES = {
    "knee": ({"right_knee.x": -30}, {"knee_flexion": 30}),
    "elbow": ({"right_elbow.x": 40}, {"elbow_flexion": 40}),
    "thigh forward": ({"right_hip.x": 30}, {"hip_flexion": 30}),
    "thigh backward": ({"right_hip.x": -20}, {"hip_flexion": -20}),
    "thigh inward": ({"right_hip.z": 10}, {"hip_adduction": 10}),
    "thigh outward": ({"right_hip.z": -15}, {"hip_adduction": -15}),
    "thigh rotated inward": ({"right_knee.x": -30, "right_hip.y": -20}, {"knee_flexion": 30, "hip_rotation": 20}),
    "arm forward": ({"right_shoulder.x": 30}, {"shoulder_flexion": 30, "shoulder_elevation": 30, "shoulder_plane": 90}),
    "arm backward": ({"right_shoulder.x": -30}, {"shoulder_flexion": -30, "shoulder_elevation": 30, "shoulder_plane": -90}),
    "arm sideways": ({"right_shoulder.z": -60}, {"shoulder_adduction": -60, "shoulder_elevation": 60}),
    "arm raised sideways": ({"right_shoulder.z": -130}, {"shoulder_adduction": -130, "shoulder_elevation": 130}),
    "arm almost vertical": ({"right_shoulder.z": -150}, {"shoulder_adduction": -150, "shoulder_elevation": 150}),
    "arm up ahead": ({"right_shoulder.x": 140}, {"shoulder_flexion": 140, "shoulder_elevation": 140, "shoulder_plane": 90}),
    "arm rotated inward": ({"right_elbow.x": 30, "right_shoulder.y": -20}, {"elbow_flexion": 30, "shoulder_rotation": 20}),
    "head forward": ({"neck.x": 15}, {"neck_flexion": 15}),
    "head to the right": ({"neck.z": 15}, {"neck_bending": 15}),
}
OF_FOURTEEN = {
    "toes up": ({"right_ankle.x": 15}, {"ankle_dorsiflexion": 15}),
    "toes down": ({"right_ankle.x": -15}, {"ankle_dorsiflexion": -15}),
    "whole body forward": ({"navel.x": 20}, {"pelvis_tilt": 20, "trunk_forward_lean": 20}),
    "whole body to the right": ({"navel.z": 10}, {"pelvis_obliquity": 10, "trunk_lateral_lean": 10}),
    "trunk forward": ({"waist.x": 25}, {"trunk_flexion": 25, "trunk_forward_lean": 25}),
    "trunk to the right": ({"waist.z": 12}, {"trunk_bending": 12, "trunk_lateral_lean": 12}),
    "trunk to the left": ({"waist.y": 18}, {"trunk_rotation": 18}),
}
OF_TEN = {
    "whole body forward": ({"navel.x": 20}, {"trunk_forward_lean": 20}),
    "whole body to the right": ({"navel.z": 10}, {"trunk_lateral_lean": 10}),
}
BY_ANATOMY = [
    *((TEN_PARTS, name, *case) for name, case in (CASES | OF_TEN).items()),
    *((FOURTEEN_PARTS, name, *case) for name, case in (CASES | OF_FOURTEEN).items()),
]


def found_of(anatomy: Anatomy, changes: dict[str, float]) -> dict[str, Floats]:
    return clinical_angles(joint_rotations(anatomy, posed(anatomy, changes)))


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    ("anatomy", "name", "changes", "expected"), BY_ANATOMY, ids=lambda v: v if isinstance(v, str) else ""
)
def test_a_joint_turned_alone_changes_its_angles_by_as_much(
    anatomy: Anatomy, name: str, changes: dict[str, float], expected: dict[str, float], side: str
) -> None:
    pose = posed(anatomy, changes)
    found = clinical_angles(joint_rotations(anatomy, pose if side == "right" else mirrored(anatomy, pose)))
    expected = {angle if angle in found else f"{angle}_{side[0]}": value for angle, value in expected.items()}
    expected = {angle: -value if side == "left" and angle in LATERAL else value for angle, value in expected.items()}
    assert set(expected) <= set(found)
    for angle, (value,) in found.items():
        if np.isfinite(value) or angle in expected:
            assert value == pytest.approx(expected.get(angle, 0.0), abs=1e-9), angle


def test_the_neutral_pose_has_no_angles_and_no_axial_rotation() -> None:
    found = found_of(FOURTEEN_PARTS, {})
    assert list(found) == [angle.name for angle in ANGLES]
    undefined = {name for name, (value,) in found.items() if np.isnan(value)}
    assert undefined == {
        f"{name}_{side}" for name in ("hip_rotation", "shoulder_rotation", "shoulder_plane") for side in "rl"
    }
    assert all(abs(value) < 1e-9 for name, (value,) in found.items() if name not in undefined)


def test_ten_parts_have_no_angles_of_pelvis_and_ankles() -> None:
    missing = {angle.name for angle in ANGLES} - set(found_of(TEN_PARTS, {}))
    trunk = {"trunk_flexion", "trunk_bending", "trunk_rotation", "pelvis_tilt", "pelvis_obliquity"}
    assert missing == trunk | {"ankle_dorsiflexion_r", "ankle_dorsiflexion_l"}


def test_an_axial_rotation_needs_a_flexed_hinge() -> None:
    for flexion, defined in ((LEAST_FLEXION_DEG - 1, False), (LEAST_FLEXION_DEG + 1, True)):
        found = found_of(TEN_PARTS, {"right_knee.x": -flexion, "right_elbow.x": flexion})
        assert np.isfinite(found["hip_rotation_r"][0]) == defined
        assert np.isfinite(found["shoulder_rotation_r"][0]) == defined


def test_flexion_of_an_arm_stretched_sideways_is_not_defined() -> None:
    nearest = 90.0 - FROM_LOCK_DEG
    for adduction, defined in ((nearest - 1, True), (nearest + 1, False), (179 - nearest, False), (181 - nearest, True)):
        found = found_of(TEN_PARTS, {"right_shoulder.z": -adduction})
        assert np.isfinite(found["shoulder_flexion_r"][0]) == defined
        assert found["shoulder_elevation_r"][0] == pytest.approx(adduction)


def test_unknown_rows_stay_unknown() -> None:
    angles = np.concatenate([posed(FOURTEEN_PARTS, BENT_KNEES), np.full((1, len(FOURTEEN_PARTS.angles)), np.nan)])
    for name, values in clinical_angles(joint_rotations(FOURTEEN_PARTS, angles)).items():
        assert np.isnan(values[1]), name


def test_an_elbow_that_flexes_backward_equals_one_turned_by_half_a_turn() -> None:
    one = found_of(TEN_PARTS, {"right_elbow.x": -50, "right_shoulder.y": 30})
    other = found_of(TEN_PARTS, {"right_elbow.x": 50, "right_shoulder.y": -150})
    assert one["elbow_flexion_r"][0] == pytest.approx(50.0)
    for name, values in one.items():
        np.testing.assert_allclose(values, other[name], atol=1e-9, err_msg=name)


def test_an_anatomy_without_a_trunk_is_an_error() -> None:
    bare = Anatomy("legs", FOURTEEN_PARTS.joints[:1], ())
    with pytest.raises(ValueError, match="anatomy 'legs': allowed: one with a torso, or with pelvis and chest"):
        joint_rotations(bare, np.zeros((1, 3)))


def assert_equal_turns(found: Floats, expected: Floats, name: str) -> None:
    """Degrees, equal but for whole turns; unknown where they are expected to be."""
    turns = (found - expected + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(turns, np.where(np.isnan(expected), np.nan, 0.0), atol=1e-6, err_msg=name)


@pytest.mark.slow
@each_anatomy
@given(seed=st.integers(0, 10_000), heading=st.floats(-7.0, 7.0))
@settings(max_examples=40)
def test_a_rotation_about_the_vertical_changes_no_angle(anatomy: Anatomy, seed: int, heading: float) -> None:
    angles = random_pose(anatomy, seed).angles[None]
    turned = angles.copy()
    turned[0, anatomy.index["navel.y"]] += heading
    one, other = (clinical_angles(joint_rotations(anatomy, poses)) for poses in (angles, turned))
    for name, values in one.items():
        assert_equal_turns(other[name], values, name)


@pytest.mark.slow
@each_anatomy
@given(seed=st.integers(0, 10_000))
@settings(max_examples=40)
def test_a_mirrored_pose_has_the_angles_of_the_other_side(anatomy: Anatomy, seed: int) -> None:
    angles = random_pose(anatomy, seed).angles[None]
    one, two = (clinical_angles(joint_rotations(anatomy, poses)) for poses in (angles, mirrored(anatomy, angles)))
    for name, values in one.items():
        other = name[:-1] + {"r": "l", "l": "r"}[name[-1]] if name.endswith(("_r", "_l")) else name
        assert_equal_turns(two[other], -values if name in LATERAL else values, name)


@pytest.mark.slow
@each_anatomy
@given(seed=st.integers(0, 10_000))
@settings(max_examples=40)
def test_knee_elbow_and_arm_elevation_are_angles_between_joint_centres(anatomy: Anatomy, seed: int) -> None:
    pose = random_pose(anatomy, seed)
    at = {name: points[0] for name, points in named_centres(anatomy, body(anatomy), [pose]).items()}
    found = clinical_angles(joint_rotations(anatomy, pose.angles[None]))
    for letter, side in (("R", "r"), ("L", "l")):
        for flexion, (start, middle, end) in (
            ("knee_flexion", ("Hip", "Knee", "Ankle")), ("elbow_flexion", ("Shoulder", "Elbow", "Wrist")),
        ):  # fmt: skip
            upper = unit(at[letter + middle] - at[letter + start])
            lower = unit(at[letter + end] - at[letter + middle])
            angle = np.degrees(np.arccos(np.clip(upper @ lower, -1.0, 1.0)))
            assert found[f"{flexion}_{side}"][0] == pytest.approx(angle, abs=1e-4)
        if anatomy is TEN_PARTS:
            down = unit(at["Hip"] - at["Neck"])
            arm = unit(at[f"{letter}Elbow"] - at[f"{letter}Shoulder"])
            elevation = np.degrees(np.arccos(np.clip(arm @ down, -1.0, 1.0)))
            assert found[f"shoulder_elevation_{side}"][0] == pytest.approx(elevation, abs=1e-4)


@given(st.lists(st.floats(-3.1, 3.1), min_size=3, max_size=3), st.sampled_from(["zxy", "yxz", "xyz", "yzx"]))
def test_cardan_angles_agree_with_scipy(angles: list[float], axes: str) -> None:
    rotation = Rotation.from_euler(axes.upper(), angles)
    found = cardan_angles(axes, np.asarray(rotation.as_matrix())[None])[0]
    assert abs(found[1]) <= np.pi / 2 + 1e-9
    again = Rotation.from_euler(axes.upper(), found)
    assert (rotation.inv() * again).magnitude() < 1e-6


def test_a_trunk_that_does_not_bend_stays_the_same_as_one_part() -> None:
    angles = posed(FOURTEEN_PARTS, {"navel.x": 20, "right_hip.x": 30, "left_shoulder.x": 40, "neck.x": 10})
    rotations = joint_rotations(FOURTEEN_PARTS, angles)
    one, other = clinical_angles(with_rigid_trunk(rotations)), clinical_angles(rotations)
    for name, values in one.items():
        np.testing.assert_allclose(values, other[name], atol=1e-9, err_msg=name)
    assert set(other) - set(one) == {"pelvis_tilt", "pelvis_obliquity", "trunk_flexion", "trunk_bending", "trunk_rotation"}


def test_a_trunk_as_one_part_is_that_of_ten_parts_from_joint_centres() -> None:
    changes = {"waist.x": 20, "waist.z": 10, "navel.x": 10, "right_hip.x": 40, "left_shoulder.x": 60, **BENT_KNEES}
    angles = posed(FOURTEEN_PARTS, changes)
    centres = named_centres(FOURTEEN_PARTS, body(FOURTEEN_PARTS), [Pose(np.zeros(3), angles[0])])
    ten = np.array([one.angles for one in poses_from_centres(TEN_PARTS, centres)])
    expected = clinical_angles(joint_rotations(TEN_PARTS, ten))
    found = clinical_angles(with_rigid_trunk(joint_rotations(FOURTEEN_PARTS, angles)))
    for name in ("trunk_forward_lean", "trunk_lateral_lean", "hip_flexion_r", "hip_adduction_r", "shoulder_flexion_l"):
        # The waist of this body is at 0.38 of the trunk, not at 0.35.
        np.testing.assert_allclose(found[name], expected[name], atol=1.5, err_msg=name)
