"""Inverse kinematics: round trips, continuous angles, rules for unknown rotations."""

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.anatomies import each_anatomy
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy, without_side
from zenocap.common.body.definition import Bdp, Pose, neutral_pose
from zenocap.common.body.inverse_kinematics import CLEAR, hinge_axes, interpolated_centres, poses_from_centres
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.body.rotations import euler_to_matrix, perpendicular, unit

MILLIMETRE = 1e-3
BENT = np.radians(12.0)


def body(anatomy: Anatomy) -> Bdp:
    """A body; with fourteen parts its hips are below the navel and the head's axis begins above its joint."""
    if anatomy is TEN_PARTS:
        return body_from_lengths(TEN_PARTS, average_lengths(1.75))
    offsets = {
        "waist": (0, 0.18, 0), "neck_base": (0, 0.33, 0), "neck": (0, 0.07, 0), "shoulder": (0.17, 0.33, 0),
        "elbow": (0, 0.31, 0), "hip": (0.09, -0.02, 0), "knee": (0, 0.43, 0), "ankle": (0, 0.42, 0),
    }  # fmt: skip
    heights = {"head": 0.15, "lower_arm": 0.44, "foot": 0.23}
    sizes, origins, bases = [], [], np.zeros((len(anatomy.joints), 3))
    for k, joint in enumerate(anatomy.joints):
        name, part = without_side(joint.name), without_side(joint.part)
        x, y, z = offsets.get(name, (0, 0, 0))
        origins.append((-x if joint.name.startswith("right_") else x, y, z))
        sizes.append((heights.get(part, 0.3), 0.05, 0.05))
        if part == "head":
            bases[k] = 0.0, 0.09, 0.012
    return Bdp(np.array(sizes), np.array(origins), None, bases)


def named_centres(anatomy: Anatomy, bdp: Bdp, poses: list[Pose]) -> dict[str, Floats]:
    """Marker positions by name, and `Waist`."""
    points = np.stack([joint_centres(anatomy, bdp, pose) for pose in poses])
    named = {marker.name: points[:, k] for k, marker in enumerate(anatomy.markers)}
    if anatomy is FOURTEEN_PARTS:
        chest = anatomy.index["chest"]
        named["Waist"] = np.stack([part_frames(anatomy, bdp, pose)[chest, :, 3] for pose in poses])
    return named


def random_pose(anatomy: Anatomy, seed: int) -> Pose:
    """A pose within the limits, without straight limbs; elbows and knees flex in their natural direction."""
    rng = np.random.default_rng(seed)
    low, high = anatomy.limits.T.copy()
    for side in ("right", "left"):
        low[anatomy.index[f"{side}_elbow.x"]], high[anatomy.index[f"{side}_knee.x"]] = BENT, -BENT
        if anatomy is FOURTEEN_PARTS:
            low[anatomy.index[f"{side}_ankle.x"]] = high[anatomy.index[f"{side}_ankle.x"]] = np.pi / 2
    return Pose(rng.uniform(-2, 2, 3), rng.uniform(low, high))


@pytest.mark.nightly
@each_anatomy
@given(seed=st.integers(0, 10_000))
@settings(max_examples=60)
def test_centres_of_any_pose_round_trip(anatomy: Anatomy, seed: int) -> None:
    bdp = body(anatomy)
    centres = named_centres(anatomy, bdp, [random_pose(anatomy, seed)])
    again = named_centres(anatomy, bdp, poses_from_centres(anatomy, centres, bdp))
    for name, points in centres.items():
        np.testing.assert_allclose(again[name], points, atol=MILLIMETRE, err_msg=name)


@pytest.mark.slow
@given(seed=st.integers(0, 10_000))
@settings(max_examples=40)
def test_without_waist_a_spine_with_lateral_bend_and_twist_round_trips(seed: int) -> None:
    bdp, pose = body(FOURTEEN_PARTS), random_pose(FOURTEEN_PARTS, seed)
    pose.angles[FOURTEEN_PARTS.index["waist.x"]] = 0.0
    centres = named_centres(FOURTEEN_PARTS, bdp, [pose])
    without_waist = {name: points for name, points in centres.items() if name != "Waist"}
    again = named_centres(FOURTEEN_PARTS, bdp, poses_from_centres(FOURTEEN_PARTS, without_waist, bdp))
    for name in ("Hip", "Neck", "Waist", "RElbow", "LWrist", "RAnkle", "Head"):
        np.testing.assert_allclose(again[name], centres[name], atol=MILLIMETRE, err_msg=name)


@pytest.mark.slow
@given(seed=st.integers(0, 10_000), bend=st.floats(0, 12))
@settings(max_examples=40)
def test_a_nearly_straight_limb_ends_within_centimetres(seed: int, bend: float) -> None:
    bdp, pose = body(FOURTEEN_PARTS), random_pose(FOURTEEN_PARTS, seed)
    for side in ("right", "left"):
        pose.angles[FOURTEEN_PARTS.index[f"{side}_elbow.x"]] = np.radians(bend)
        pose.angles[FOURTEEN_PARTS.index[f"{side}_knee.x"]] = -np.radians(bend)
    centres = named_centres(FOURTEEN_PARTS, bdp, [pose])
    again = named_centres(FOURTEEN_PARTS, bdp, poses_from_centres(FOURTEEN_PARTS, centres, bdp))
    for name in ("RWrist", "LWrist", "RAnkle", "LAnkle"):
        assert np.linalg.norm(again[name] - centres[name]) < 0.05, name


def swinging(count: int) -> list[Pose]:
    """An arm that is straight, flexes and is straight again while it is raised sideways."""
    poses = []
    for share in np.linspace(0, 1, count):
        pose = neutral_pose(FOURTEEN_PARTS, np.zeros(3), 7.0 * share)
        pose.angles[FOURTEEN_PARTS.index["right_shoulder.z"]] = np.pi * (1 - 0.5 * share)
        pose.angles[FOURTEEN_PARTS.index["right_shoulder.y"]] = 0.8
        pose.angles[FOURTEEN_PARTS.index["right_elbow.x"]] = 1.5 * np.sin(np.pi * share) ** 2
        poses.append(pose)
    return poses


def test_axial_rotation_of_a_straight_limb_is_interpolated_and_yaw_grows_past_a_full_turn() -> None:
    bdp, poses = body(FOURTEEN_PARTS), swinging(60)
    found = poses_from_centres(FOURTEEN_PARTS, named_centres(FOURTEEN_PARTS, bdp, poses), bdp)
    yaw = np.array([pose.angles[FOURTEEN_PARTS.index["navel.y"]] for pose in found])
    np.testing.assert_allclose(yaw, np.linspace(0, 7.0, 60), atol=1e-6)
    at = FOURTEEN_PARTS.index["right_upper_arm"]
    for pose, again in zip(poses[8:-8], found[8:-8], strict=True):
        ours, theirs = (part_frames(FOURTEEN_PARTS, bdp, p)[at, :, :3] for p in (pose, again))
        assert np.arccos(min(ours[:, 0] @ theirs[:, 0], 1.0)) < np.radians(6.0)


@each_anatomy
def test_unknown_centres_are_interpolated(anatomy: Anatomy) -> None:
    bdp = body(anatomy)
    poses = [neutral_pose(anatomy, np.array([0.1 * k, 1.0, 0.0])) for k in range(5)]
    centres = named_centres(anatomy, bdp, poses)
    expected = poses_from_centres(anatomy, centres, bdp)
    with_gap = {name: points.copy() for name, points in centres.items()}
    with_gap["RKnee"][2] = np.nan
    for pose, again in zip(expected, poses_from_centres(anatomy, with_gap, bdp), strict=True):
        np.testing.assert_allclose(again.angles, pose.angles, atol=1e-9)
        np.testing.assert_allclose(again.position, pose.position, atol=1e-9)


def test_errors_name_the_missing_centres_and_the_anatomy_without_a_head() -> None:
    centres = named_centres(TEN_PARTS, body(TEN_PARTS), [neutral_pose(TEN_PARTS, np.zeros(3))])
    with pytest.raises(ValueError, match="'legs': allowed"):
        poses_from_centres(Anatomy("legs", TEN_PARTS.joints[6:], TEN_PARTS.markers), centres)
    del centres["LKnee"]
    centres["RWrist"][:] = np.nan
    with pytest.raises(ValueError, match=r"RWrist, LKnee: in no frame; there are: Hip, RHip"):
        interpolated_centres(centres)


def standing_with_toes(below: float) -> Mapping[str, Floats]:
    """Twenty upright frames; the right foot's toes rise by half a radian in the last five."""
    bdp = body(FOURTEEN_PARTS)
    poses = [neutral_pose(FOURTEEN_PARTS, np.array([0.0, 0.95, 0.0])) for _ in range(20)]
    centres = named_centres(FOURTEEN_PARTS, bdp, poses)
    rise = np.where(np.arange(20) < 15, 0.0, 0.5)
    for letter, lifted in (("R", rise), ("L", 0.0 * rise)):
        ball = euler_to_matrix("x", (below - lifted)[:, None]) @ np.array([0.0, 0.0, 0.15])
        centres[f"{letter}Toe"] = centres[f"{letter}Ankle"] + ball
    return centres


def test_feet_follow_the_toe_markers_and_are_flat_while_standing() -> None:
    poses = poses_from_centres(FOURTEEN_PARTS, standing_with_toes(0.35))
    at = [FOURTEEN_PARTS.index[f"{side}_ankle.x"] for side in ("right", "left")]
    bent = np.array([pose.angles[at] for pose in poses]) - np.pi / 2
    np.testing.assert_allclose(bent, [[0.0, 0.0]] * 15 + [[0.5, 0.0]] * 5, atol=1e-6)


def test_toes_turned_out_rotate_a_straight_leg() -> None:
    centres = dict(standing_with_toes(0.35))
    out = euler_to_matrix("y", np.full((20, 1), 0.4))
    centres["LToe"] = centres["LAnkle"] + np.einsum("nij,nj->ni", out, centres["LToe"] - centres["LAnkle"])
    poses = poses_from_centres(FOURTEEN_PARTS, centres)
    thigh = part_frames(FOURTEEN_PARTS, body(FOURTEEN_PARTS), poses[3])[FOURTEEN_PARTS.index["left_upper_leg"]]
    assert np.arctan2(thigh[0, 2], thigh[2, 2]) == pytest.approx(0.4, abs=0.01)


@given(seed=st.integers(0, 10_000))
def test_hinge_axis_without_measurements_is_the_natural_axis(seed: int) -> None:
    direction, natural = unit(np.random.default_rng(seed).normal(size=(2, 5, 3)))
    axes = hinge_axes(direction[:1], (), natural[:1])
    np.testing.assert_allclose(axes, unit(perpendicular(natural[:1], direction[:1])), atol=1e-9)


def test_hinge_axis_follows_measurements_when_bent_and_neighbours_when_straight() -> None:
    count = 61
    direction = np.tile([0.0, -1.0, 0.0], (count, 1))
    turn = np.linspace(0.0, 1.0, count)
    true = np.stack([-np.cos(turn), np.zeros(count), np.sin(turn)], axis=1)
    bend = np.radians(np.abs(np.linspace(-60, 60, count)))
    noisy = true * np.sin(bend)[:, None] + np.random.default_rng(3).normal(0, 0.02, (count, 3)) * [1, 0, 1]
    axes = hinge_axes(direction, ((noisy, CLEAR**-4, 4),), np.tile([-1.0, 0.0, 0.0], (count, 1)))
    wrong = np.arccos(np.clip(np.sum(axes * true, axis=1), -1, 1))
    assert wrong.max() < np.radians(12)
    assert np.abs(np.sum(axes * direction, axis=1)).max() < 1e-9
    steps = np.arccos(np.clip(np.sum(axes[1:] * axes[:-1], axis=1), -1, 1))
    assert steps.max() < np.radians(8)
