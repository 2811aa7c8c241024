"""From joint centres to poses: the same centres come back, smoothly, whichever way the body faces."""

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy, Floats
from common.body.definition import Bdp, Pose, neutral_pose
from common.body.euler import rotation
from common.body.from_centres import filled, poses_from_centres
from common.body.kinematics import joint_centres, part_frames
from common.body.proportions import body_from_lengths, lengths_of_height

MILLIMETRE = 1e-3
BOTH = (TEN_PARTS, FOURTEEN_PARTS)
BENT = np.radians(12.0)


def body(anatomy: Anatomy) -> Bdp:
    """Of fourteen parts: sizes of a person, hips below the navel, a head whose axis begins above its joint."""
    if anatomy is TEN_PARTS:
        return body_from_lengths(TEN_PARTS, lengths_of_height(1.75))
    offsets = {
        "waist": (0, 0.18, 0), "neck_base": (0, 0.33, 0), "neck": (0, 0.07, 0), "shoulder": (0.17, 0.33, 0),
        "elbow": (0, 0.31, 0), "hip": (0.09, -0.02, 0), "knee": (0, 0.43, 0), "ankle": (0, 0.42, 0),
    }  # fmt: skip
    heights = {"head": 0.15, "lower_arm": 0.44, "foot": 0.23}
    sizes, origins, bases = [], [], np.zeros((len(anatomy.joints), 3))
    for k, joint in enumerate(anatomy.joints):
        name, part = (text.removeprefix("right_").removeprefix("left_") for text in (joint.name, joint.part))
        x, y, z = offsets.get(name, (0, 0, 0))
        origins.append((-x if joint.name.startswith("right_") else x, y, z))
        sizes.append((heights.get(part, 0.3), 0.05, 0.05))
        if part == "head":
            bases[k] = 0.0, 0.09, 0.012
    return Bdp(np.array(sizes), np.array(origins), None, bases)


def named_centres(anatomy: Anatomy, bdp: Bdp, poses: list[Pose]) -> dict[str, Floats]:
    """The markers, and where the spine bends."""
    points = np.stack([joint_centres(anatomy, bdp, pose) for pose in poses])
    named = {marker.name: points[:, k] for k, marker in enumerate(anatomy.markers)}
    if anatomy is FOURTEEN_PARTS:
        chest = anatomy.index["chest"]
        named["Waist"] = np.stack([part_frames(anatomy, bdp, pose)[chest, :, 3] for pose in poses])
    return named


def random_pose(anatomy: Anatomy, seed: int) -> Pose:
    """Within the limits; elbows bend the way the model has them, limbs are not straight, nobody lies on the back of the
    head."""
    rng = np.random.default_rng(seed)
    low, high = anatomy.limits.T.copy()
    for side in ("right", "left"):
        low[anatomy.index[f"{side}_elbow.x"]], high[anatomy.index[f"{side}_knee.x"]] = BENT, -BENT
        if anatomy is FOURTEEN_PARTS:
            low[anatomy.index[f"{side}_ankle.x"]] = high[anatomy.index[f"{side}_ankle.x"]] = np.pi / 2
    return Pose(rng.uniform(-2, 2, 3), rng.uniform(low, high))


@pytest.mark.parametrize("anatomy", BOTH, ids=lambda a: a.name)
@given(seed=st.integers(0, 10_000))
@settings(deadline=None, max_examples=60)
def test_the_centres_of_any_pose_come_back(anatomy: Anatomy, seed: int) -> None:
    bdp = body(anatomy)
    centres = named_centres(anatomy, bdp, [random_pose(anatomy, seed)])
    again = named_centres(anatomy, bdp, poses_from_centres(anatomy, centres, bdp))
    for name, points in centres.items():
        np.testing.assert_allclose(again[name], points, atol=MILLIMETRE, err_msg=name)


@given(seed=st.integers(0, 10_000))
@settings(deadline=None, max_examples=40)
def test_without_a_waist_a_spine_that_bends_sideways_and_twists_comes_back(seed: int) -> None:
    bdp, pose = body(FOURTEEN_PARTS), random_pose(FOURTEEN_PARTS, seed)
    pose.angles[FOURTEEN_PARTS.index["waist.x"]] = 0.0
    centres = named_centres(FOURTEEN_PARTS, bdp, [pose])
    bare = {name: points for name, points in centres.items() if name != "Waist"}
    again = named_centres(FOURTEEN_PARTS, bdp, poses_from_centres(FOURTEEN_PARTS, bare, bdp))
    for name in ("Hip", "Neck", "Waist", "RElbow", "LWrist", "RAnkle", "Head"):
        np.testing.assert_allclose(again[name], centres[name], atol=MILLIMETRE, err_msg=name)


@given(seed=st.integers(0, 10_000), bend=st.floats(0, 12))
@settings(deadline=None, max_examples=40)
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
    """An arm that is stretched, bends and is stretched again while it is raised to the side."""
    poses = []
    for share in np.linspace(0, 1, count):
        pose = neutral_pose(FOURTEEN_PARTS, np.zeros(3), 7.0 * share)
        pose.angles[FOURTEEN_PARTS.index["right_shoulder.z"]] = np.pi * (1 - 0.5 * share)
        pose.angles[FOURTEEN_PARTS.index["right_shoulder.y"]] = 0.8
        pose.angles[FOURTEEN_PARTS.index["right_elbow.x"]] = 1.5 * np.sin(np.pi * share) ** 2
        poses.append(pose)
    return poses


def test_the_turn_of_a_limb_is_carried_over_where_it_is_straight() -> None:
    bdp, poses = body(FOURTEEN_PARTS), swinging(60)
    found = poses_from_centres(FOURTEEN_PARTS, named_centres(FOURTEEN_PARTS, bdp, poses), bdp)
    at = FOURTEEN_PARTS.index["right_upper_arm"]
    for pose, again in zip(poses[8:-8], found[8:-8], strict=True):
        ours, theirs = (part_frames(FOURTEEN_PARTS, bdp, p)[at, :, :3] for p in (pose, again))
        assert np.arccos(min(ours[:, 0] @ theirs[:, 0], 1.0)) < np.radians(6.0)


def test_who_turns_past_a_whole_turn_does_not_jump_back() -> None:
    bdp = body(FOURTEEN_PARTS)
    found = poses_from_centres(FOURTEEN_PARTS, named_centres(FOURTEEN_PARTS, bdp, swinging(60)), bdp)
    yaw = np.array([pose.angles[FOURTEEN_PARTS.index["navel.y"]] for pose in found])
    np.testing.assert_allclose(yaw, np.linspace(0, 7.0, 60), atol=1e-6)


@pytest.mark.parametrize("anatomy", BOTH, ids=lambda a: a.name)
def test_unknown_centres_are_interpolated(anatomy: Anatomy) -> None:
    bdp = body(anatomy)
    poses = [neutral_pose(anatomy, np.array([0.1 * k, 1.0, 0.0])) for k in range(5)]
    centres = named_centres(anatomy, bdp, poses)
    expected = poses_from_centres(anatomy, centres, bdp)
    torn = {name: points.copy() for name, points in centres.items()}
    torn["RKnee"][2] = np.nan
    for pose, again in zip(expected, poses_from_centres(anatomy, torn, bdp), strict=True):
        np.testing.assert_allclose(again.angles, pose.angles, atol=1e-9)
        np.testing.assert_allclose(again.position, pose.position, atol=1e-9)


def test_missing_centres_are_named() -> None:
    centres = named_centres(TEN_PARTS, body(TEN_PARTS), [neutral_pose(TEN_PARTS, np.zeros(3))])
    del centres["LKnee"]
    centres["RWrist"][:] = np.nan
    with pytest.raises(ValueError, match=r"RWrist, LKnee: in no frame; there are: Hip, RHip"):
        filled(centres)


def standing_with_toes(below: float) -> Mapping[str, Floats]:
    """Twenty frames upright; the right foot's toes rise by half a radian in the last five."""
    bdp = body(FOURTEEN_PARTS)
    poses = [neutral_pose(FOURTEEN_PARTS, np.array([0.0, 0.95, 0.0])) for _ in range(20)]
    centres = named_centres(FOURTEEN_PARTS, bdp, poses)
    rise = np.where(np.arange(20) < 15, 0.0, 0.5)
    for letter, lifted in (("R", rise), ("L", 0.0 * rise)):
        ball = rotation("x", (below - lifted)[:, None]) @ np.array([0.0, 0.0, 0.15])
        centres[f"{letter}Toe"] = centres[f"{letter}Ankle"] + ball
    return centres


def test_feet_follow_their_toes_and_stand_flat() -> None:
    poses = poses_from_centres(FOURTEEN_PARTS, standing_with_toes(0.35))
    ankle = np.array([pose.angles[FOURTEEN_PARTS.index["right_ankle.x"]] for pose in poses])
    np.testing.assert_allclose(ankle[:15], np.pi / 2, atol=1e-6)
    np.testing.assert_allclose(ankle[15:], np.pi / 2 + 0.5, atol=1e-6)
    other = [pose.angles[FOURTEEN_PARTS.index["left_ankle.x"]] for pose in poses]
    np.testing.assert_allclose(other, np.pi / 2, atol=1e-6)


def test_toes_out_turn_a_straight_leg() -> None:
    centres = dict(standing_with_toes(0.35))
    out = rotation("y", np.full((20, 1), 0.4))
    centres["LToe"] = centres["LAnkle"] + np.einsum("nij,nj->ni", out, centres["LToe"] - centres["LAnkle"])
    poses = poses_from_centres(FOURTEEN_PARTS, centres)
    thigh = part_frames(FOURTEEN_PARTS, body(FOURTEEN_PARTS), poses[3])[FOURTEEN_PARTS.index["left_upper_leg"]]
    assert np.arctan2(thigh[0, 2], thigh[2, 2]) == pytest.approx(0.4, abs=0.01)


def test_another_anatomy_is_refused() -> None:
    strange = Anatomy("legs", TEN_PARTS.joints[6:], TEN_PARTS.markers, frozenset())
    centres = named_centres(TEN_PARTS, body(TEN_PARTS), [neutral_pose(TEN_PARTS, np.zeros(3))])
    with pytest.raises(ValueError, match="'legs': allowed"):
        poses_from_centres(strange, centres)
