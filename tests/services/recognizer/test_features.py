"""Ten features of a pose: the paper's angles, and arcs without singularities, of both anatomies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.common.body.test_inverse_kinematics import body, random_pose
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.recognizer.features import KINDS, MIDDLES, NAMES, features_of

BOTH = tuple(ANATOMIES.values())
seeds = st.integers(0, 10_000)


def feature(anatomy: Anatomy, name: str, **angles: float) -> float:
    """One feature of the upright pose with some angles changed; `right_shoulder_z=...`."""
    pose = anatomy.neutral.copy()
    for key, value in angles.items():
        joint, axis = key.rsplit("_", 1)
        pose[anatomy.index[f"{joint}.{axis}"]] = value
    return float(features_of(anatomy, pose)[NAMES.index(name)])


def test_the_papers_features_are_its_ten_joint_angles() -> None:
    angles = random_pose(TEN_PARTS, 3).angles
    expected = [angles[TEN_PARTS.index[name]] for name in NAMES]
    np.testing.assert_allclose(features_of(TEN_PARTS, angles, "joint-angles"), expected, atol=1e-12)


@given(seeds, st.integers(-2, 2))
def test_whole_turns_of_an_angle_change_nothing(seed: int, turns: int) -> None:
    angles = random_pose(TEN_PARTS, seed).angles
    turned = angles.copy()
    for name in NAMES:
        if "elbow" not in name:
            turned[TEN_PARTS.index[name]] += 2 * np.pi * turns
    for kind in KINDS:
        np.testing.assert_allclose(features_of(TEN_PARTS, turned, kind), features_of(TEN_PARTS, angles, kind), atol=1e-9)


@given(seeds)
def test_equivalent_euler_angles_have_equal_features(seed: int) -> None:
    """(z + 180°, 180° - x, y + 180°) is the same upper arm, turned about itself by 180°; the elbow is negative then."""
    angles = random_pose(TEN_PARTS, seed).angles
    other = angles.copy()
    for side in ("right", "left"):
        x, z, elbow = (TEN_PARTS.index[f"{side}_{name}"] for name in ("shoulder.x", "shoulder.z", "elbow.x"))
        other[x], other[z], other[elbow] = np.pi - angles[x], angles[z] + np.pi, -angles[elbow]
    np.testing.assert_allclose(features_of(TEN_PARTS, other), features_of(TEN_PARTS, angles), atol=1e-9)


@pytest.mark.parametrize("anatomy", BOTH, ids=lambda a: a.name)
@pytest.mark.parametrize("side", ["right", "left"])
def test_arcs_increase_to_the_front_and_to_the_persons_own_side(anatomy: Anatomy, side: str) -> None:
    out = -1.0 if side == "right" else 1.0
    hanging, joint = np.pi, f"{side}_shoulder"
    before = feature(anatomy, f"{joint}.x")
    assert feature(anatomy, f"{joint}.x", **{f"{joint}_x": np.radians(60)}) > before + 0.5
    sideways = feature(anatomy, f"{joint}.z", **{f"{joint}_z": hanging + out * np.radians(60)})
    assert sideways > feature(anatomy, f"{joint}.z") + 0.5


@pytest.mark.parametrize("joint", ["shoulder", "hip"])
def test_the_length_of_an_arc_is_the_angle_from_the_middle(joint: str) -> None:
    middle = np.array(MIDDLES[joint]) * np.array([-1.0, 1.0, 1.0])
    middle /= np.linalg.norm(middle)
    for x, z in ((0.0, np.pi), (0.7, 2.9), (-0.5, 3.3)):
        direction = np.array([-np.sin(z) * np.cos(x), np.cos(z) * np.cos(x), np.sin(x)])
        arc = [
            feature(TEN_PARTS, f"right_{joint}.{axis}", **{f"right_{joint}_x": x, f"right_{joint}_z": z}) for axis in "xz"
        ]
        assert np.hypot(*arc) == pytest.approx(np.arccos(middle @ direction), abs=1e-9)


def test_arcs_are_continuous_when_an_arm_passes_the_front() -> None:
    """The paper's angles change by half a turn from one frame to the next there."""
    count = 60
    angles = np.tile(TEN_PARTS.neutral, (count, 1))
    angles[:, TEN_PARTS.index["right_shoulder.x"]] = np.linspace(np.radians(80), np.radians(100), count)
    x = angles[:, TEN_PARTS.index["right_shoulder.x"]]
    angles[:, TEN_PARTS.index["right_shoulder.z"]] = np.where(x > np.pi / 2, 0.0, np.pi)
    angles[:, TEN_PARTS.index["right_shoulder.x"]] = np.where(x > np.pi / 2, np.pi - x, x)
    assert np.abs(np.diff(features_of(TEN_PARTS, angles), axis=0)).max() < 0.02
    assert np.abs(np.diff(features_of(TEN_PARTS, angles, "joint-angles"), axis=0)).max() > 3.0


def angles_of_both(seed: int) -> tuple[Floats, Floats]:
    """A fourteen-part pose within its limits, and the ten-part pose of the same joint centres."""
    low, high = FOURTEEN_PARTS.limits.T
    pose = random_pose(FOURTEEN_PARTS, seed)
    angles = np.clip(pose.angles, low, high)
    points = joint_centres(FOURTEEN_PARTS, body(FOURTEEN_PARTS), type(pose)(pose.position, angles))
    centres = {marker.name: point[None] for marker, point in zip(FOURTEEN_PARTS.markers, points, strict=True)}
    return angles, poses_from_centres(TEN_PARTS, centres)[0].angles


@pytest.mark.slow
@given(seeds)
def test_both_anatomies_have_about_the_same_arcs(seed: int) -> None:
    """Except opposite of the middle, behind the back and up, where no limb is and an arc may take either way."""
    fourteen, ten = angles_of_both(seed)
    one, other = features_of(FOURTEEN_PARTS, fourteen), features_of(TEN_PARTS, ten)
    for side, joint in (("right", "shoulder"), ("left", "shoulder"), ("right", "hip"), ("left", "hip")):
        at = [NAMES.index(f"{side}_{joint}.{axis}") for axis in "xz"]
        if np.hypot(*other[at]) < 2.0:
            assert np.degrees(np.abs(one - other)[at]).max() < 12.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("anatomy", BOTH, ids=lambda a: a.name)
def test_a_batch_of_poses_equals_single_poses_and_keeps_nan(anatomy: Anatomy, kind: str) -> None:
    angles = np.array([random_pose(anatomy, seed).angles for seed in range(6)]).reshape(2, 3, -1)
    found = features_of(anatomy, angles, kind)
    assert found.shape == (2, 3, len(NAMES))
    np.testing.assert_allclose(found[1, 2], features_of(anatomy, angles[1, 2], kind))
    angles[0, 1] = np.nan
    found = features_of(anatomy, angles, kind)
    assert np.isnan(found[0, 1]).all()
    assert np.isfinite(found[1]).all()


def test_error_names_an_invalid_shape_or_anatomy() -> None:
    with pytest.raises(ValueError, match=r"angles of shape \(3,\): allowed: \(\.\.\., 22\) of ten-parts"):
        features_of(TEN_PARTS, np.zeros(3))
    unknown = Anatomy("spider", TEN_PARTS.joints, ())
    with pytest.raises(ValueError, match="'spider': allowed: ten-parts, fourteen-parts"):
        features_of(unknown, TEN_PARTS.neutral)
