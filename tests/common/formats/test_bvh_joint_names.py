"""Roles of BVH joints under every known naming scheme; upright in our world, in metres."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.places import MOTIONS
from tests.support.pose_tracks import NAMES, body, track_of
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_joint_names import read_bvh_centres, roles_of
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import MATRICES, PER_METRE, Axes, Trajectories, Unit

FAMILIES = {
    "MotionBuilder": ("{Left}UpLeg {Left}Leg {Left}Foot {Left}ToeBase {Left}Arm {Left}ForeArm {Left}Hand", "Head"),
    "Mixamo": (
        "mixamorig:{Left}UpLeg mixamorig:{Left}Leg mixamorig:{Left}Foot mixamorig:{Left}ToeBase mixamorig:{Left}Arm "
        "mixamorig:{Left}ForeArm mixamorig:{Left}Hand mixamorig:{Left}Shoulder", "mixamorig:Head"),
    "Daz": ("{l}Thigh {l}Shin {l}Foot {l}Toe {l}Shldr {l}ForeArm {l}Hand {l}Collar {l}Buttock", "head"),
    "Reallusion": (
        "CC_Base_{L}_Thigh CC_Base_{L}_Calf CC_Base_{L}_Foot CC_Base_{L}_ToeBase CC_Base_{L}_Upperarm CC_Base_{L}_Forearm "
        "CC_Base_{L}_Hand CC_Base_{L}_ThighTwist01 CC_Base_{L}_Clavicle", "CC_Base_Head"),
    "3ds Max": (
        "Bip01_{L}_Thigh Bip01_{L}_Calf Bip01_{L}_Foot Bip01_{L}_Toe0 Bip01_{L}_UpperArm Bip01_{L}_Forearm Bip01_{L}_Hand",
        "Bip01_Head"),
    "Blender": ("thigh.{L} shin.{L} foot.{L} toe.{L} upper_arm.{L} forearm.{L} hand.{L} shoulder.{L}", "head"),
    "Acclaim": ("{l}femur {l}tibia {l}foot {l}toes {l}humerus {l}radius {l}wrist {l}hand {l}hipjoint", "head"),
    "capital letter": ("{L}thigh {L}shin {L}foot {L}toe {L}arm {L}forearm {L}hand", "Head"),
    "capitals": ("{L}_UPPERLEG {L}_LOWERLEG {L}_FOOT {L}_TOE {L}_UPPERARM {L}_LOWERARM {L}_HAND", "HEAD"),
    "capitals, side last": ("UPPERLEG_{L} LOWERLEG_{L} FOOT_{L} TOE_{L} UPPERARM_{L} LOWERARM_{L} HAND_{L}", "HEAD"),
    "Unity": ("UpperLeg_{L} LowerLeg_{L} Foot_{L} Toes_{L} UpperArm_{L} LowerArm_{L} Hand_{L} Shoulder_{L}", "Head"),
    "Unreal": ("thigh_{l} calf_{l} foot_{l} ball_{l} upperarm_{l} lowerarm_{l} hand_{l} clavicle_{l}", "head"),
    "VRM": (
        "J_Bip_{L}_UpperLeg J_Bip_{L}_LowerLeg J_Bip_{L}_Foot J_Bip_{L}_ToeBase J_Bip_{L}_UpperArm J_Bip_{L}_LowerArm "
        "J_Bip_{L}_Hand J_Bip_{L}_Shoulder", "J_Bip_C_Head"),
    "Rigify": ("DEF-thigh.{L} DEF-shin.{L} DEF-foot.{L} DEF-toe.{L} DEF-upper_arm.{L} DEF-forearm.{L} DEF-hand.{L}",
        "DEF-head"),
    "Xsens": ("{Left}Hip {Left}Knee {Left}Ankle {Left}Toe {Left}Shoulder {Left}Elbow {Left}Wrist {Left}Collar", "Head"),
    "depth camera": (
        "Hip{Left} Knee{Left} Ankle{Left} Foot{Left} Shoulder{Left} Elbow{Left} Wrist{Left} Hand{Left}", "Head"),
    "SMPL": ("{L}_Hip {L}_Knee {L}_Ankle {L}_Foot {L}_Shoulder {L}_Elbow {L}_Wrist {L}_Hand {L}_Collar", "Head"),
}  # fmt: skip


def standing(count: int = 4) -> PoseTrack:
    """Walking on the spot: thighs and knees bent in turn, upright, heading to the front and a little to the left."""
    angles = np.tile(TEN_PARTS.neutral, (count, 1))
    share = np.linspace(0, 1, count)
    for side, phase in (("right", 0.0), ("left", 1.0)):
        lifted = np.abs(phase - share)
        angles[:, TEN_PARTS.index[f"{side}_hip.x"]] = 0.9 * lifted
        angles[:, TEN_PARTS.index[f"{side}_knee.x"]] = -1.2 * lifted
        angles[:, TEN_PARTS.index[f"{side}_elbow.x"]] = 0.5
    angles[:, TEN_PARTS.index["navel.y"]] = 0.2
    return track_of(np.tile([0.3, 1.0, -0.2], (count, 1)), angles)


def by_name(data: Trajectories) -> dict[str, Floats]:
    return {name: data.points[:, k] for k, name in enumerate(data.names)}


@pytest.mark.parametrize("axes", MATRICES)
@pytest.mark.parametrize("unit", PER_METRE)
def test_axes_and_unit_are_detected_except_for_the_heading(axes: Axes, unit: Unit, tmp_path: Path) -> None:
    track = standing()
    write_bvh(tmp_path / "a.bvh", track, axes=axes, unit=unit)
    found = by_name(read_bvh_centres(tmp_path / "a.bvh"))
    expected = by_name(track.trajectories())
    turns = []
    for points in (found, expected):
        left = points["LHip"][0] - points["RHip"][0]
        turns.append(np.arctan2(-left[2], left[0]))
    c, s = np.cos(turns[1] - turns[0]), np.sin(turns[1] - turns[0])
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    for name in NAMES:
        np.testing.assert_allclose(
            (found[name] - found["Hip"]) @ turn.T, expected[name] - expected["Hip"], atol=1e-4, err_msg=name
        )


@pytest.mark.parametrize("family", FAMILIES)
def test_every_naming_convention_has_every_role(family: str) -> None:
    pattern, head = FAMILIES[family]
    names = [head]
    for side in ("Left", "Right"):
        names += pattern.format(Left=side, L=side[0], l=side[0].lower()).split()
    found = roles_of(tuple(names), Path("a.bvh"))
    assert names[found["Head"]] == head
    for side, letter in (("Left", "L"), ("Right", "R")):
        ours = pattern.format(Left=side, L=letter, l=letter.lower()).split()
        roles = ("Hip", "Knee", "Ankle", "Toe", "Shoulder", "Elbow", "Wrist")
        assert [names[found[f"{letter}{role}"]] for role in roles if f"{letter}{role}" in found] == ours[: len(roles)]


def test_missing_roles_are_listed_with_the_joints_of_the_file() -> None:
    with pytest.raises(UserError, match=r"a\.bvh: no joint for Head, RKnee.*; there are: hips, RightUpLeg"):
        roles_of(("hips", "RightUpLeg", "RightFoot"), Path("a.bvh"))


def test_an_implausible_leg_length_raises_an_error(tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", replace(standing(), bdp=body(1.0)))
    with pytest.raises(UserError, match=r"a\.bvh: a leg is \d+.* long: allowed: 0.6 to 1.1 m in m, cm, mm, inch"):
        read_bvh_centres(tmp_path / "a.bvh")


@pytest.mark.clips
@pytest.mark.parametrize("name", ["cmu_02_01", "cmu_02_03", "cmu_07_01", "cmu_10_01", "cmu_11_01"])
def test_people_in_motion_capture_are_upright_and_walk_forward(name: str) -> None:
    data = read_bvh_centres(MOTIONS / f"{name}.bvh")
    points = by_name(data)
    assert data.rate in (60.0, 120.0)
    tall = np.median(points["Head"][:, 1] - np.minimum(points["RAnkle"], points["LAnkle"])[:, 1])
    assert 1.45 < tall < 1.9
    front = np.cross((points["LHip"] - points["RHip"]).mean(axis=0), [0, 1, 0])
    way = points["Hip"][-1] - points["Hip"][0]
    toes = (points["RToe"] - points["RAnkle"] + points["LToe"] - points["LAnkle"]).mean(axis=0)
    assert front @ way > 0.9 * np.linalg.norm(front) * np.linalg.norm(way)
    assert front @ toes > 0.6 * np.linalg.norm(front) * np.linalg.norm(toes)
