"""Ground truth of the simulated person: joint centres, limb directions, angles, sizes."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp, Pose
from zenocap.simulation.body.limb_surface import arm, leg, mean_radius
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import RIGHT, SIDES, PersonPose
from zenocap.simulation.body.rotation import from_x_and_y, unit, yxz_angles, zxy_angles
from zenocap.simulation.body.skeleton import BALL, CHEST, FOOT, FOREARM, HEAD, SHANK, THIGH, UPPER_ARM, Bones, pose_bones

SIDE_NAMES = ("right", "left")
SEGMENTS = ("upper_arm", "lower_arm", "upper_leg", "lower_leg")


@dataclass(frozen=True)
class Truth:
    """Ground truth of one pose in the world.

    joints: the fifteen HALPE joint centres by name, (3,) metres; Neck is the mid-shoulder, Head the top of the head.
    yaw: heading of the torso, radians from +Z towards +X, in (-pi, pi].
    directions: unit vectors (3,) from the proximal to the distal joint, by limb segment (`right_upper_arm` ...; eight).
    angles: the pose as joint angles of the ten-part anatomy, radians by name; navel at joints["Hip"].  When a limb points
    straight forward (x = 90°, gimbal lock), only a combination of its z and y is determined.
    """

    joints: Mapping[str, Floats]
    yaw: float
    directions: Mapping[str, Floats]
    angles: Mapping[str, float]

    def ten_part_pose(self) -> Pose:
        """The pose in the tracker's representation."""
        return Pose(self.joints["Hip"], np.array([self.angles[name] for name in TEN_PARTS.angles]))


@dataclass(frozen=True)
class Sizes:
    """Sizes of a person in metres, the reference for errors of the body definition.

    torso: hip line to mid-shoulder.  head: mid-shoulder to the top of the head.  lower_arm: with the hand.
    lower_leg: knee to the sole.  radii: mean radius of a clothed segment by name (`upper_arm` ...).
    """

    torso: float
    shoulder_half: float
    hip_half: float
    torso_half_width: float
    torso_half_depth: float
    head: float
    head_half_width: float
    head_half_depth: float
    upper_arm: float
    lower_arm: float
    upper_leg: float
    lower_leg: float
    radii: Mapping[str, float]


def truth(person: Person, pose: PersonPose | Bones) -> Truth:
    bones = pose_bones(person, pose)
    joints = _joints(person, bones)
    yaw, directions = heading_and_directions(joints)
    return Truth(joints, yaw, directions, _ten_part_angles(bones, _torso(joints)))


def heading_and_directions(joints: Mapping[str, Floats]) -> tuple[float, dict[str, Floats]]:
    """`yaw` and `directions` of `Truth` for its joints."""
    directions = {}
    for side in SIDES:
        for names, segments in ((("Shoulder", "Elbow", "Wrist"), SEGMENTS[:2]), (("Hip", "Knee", "Ankle"), SEGMENTS[2:])):
            ends = [joints[f"{'RL'[side]}{name}"] for name in names]
            for segment, (start, end) in zip(segments, pairwise(ends), strict=True):
                directions[f"{SIDE_NAMES[side]}_{segment}"] = unit(end - start)
    torso = _torso(joints)
    return float(np.arctan2(torso[0, 2], torso[2, 2])), directions


def landmarks(person: Person, pose: PersonPose | Bones) -> dict[str, Floats]:
    """The fifteen joint centres of `Truth`, `RToe` and `LToe` (the balls of the feet) and `Waist` (where the spine bends).

    (3,) metres each, in the world.
    """
    bones = pose_bones(person, pose)
    points = _joints(person, bones)
    for side in SIDES:
        ball = np.array([0.0, -0.6 * person.lengths.ankle_height, BALL * person.lengths.foot])
        points[f"{'RL'[side]}Toe"] = bones.origin[FOOT[side]] + bones.rotation[FOOT[side]] @ ball
    return points | {"Waist": bones.origin[CHEST]}


def true_sizes(person: Person) -> Sizes:
    """Sizes of a clothed person, as in a silhouette."""
    size, girth, wear = person.lengths, person.girths, person.clothing
    one_arm, one_leg = arm(person, RIGHT)[0], leg(person, RIGHT)
    return Sizes(
        torso=size.torso,
        shoulder_half=size.shoulder_half,
        hip_half=size.hip_half,
        torso_half_width=float(np.mean([girth.chest[0], girth.waist[0], girth.hips[0]])) + 0.8 * wear.shirt_ease,
        torso_half_depth=float(np.mean([girth.chest[1], girth.waist[1], girth.hips[1]])) + 0.8 * wear.shirt_ease,
        head=size.head_top,
        head_half_width=girth.head[0],
        head_half_depth=girth.head[1],
        upper_arm=size.upper_arm,
        lower_arm=size.forearm + size.hand,
        upper_leg=size.thigh,
        lower_leg=size.shank + size.ankle_height,
        radii={
            "upper_arm": mean_radius(one_arm, UPPER_ARM[RIGHT]),
            "lower_arm": mean_radius(one_arm, FOREARM[RIGHT]),
            "upper_leg": mean_radius(one_leg, THIGH[RIGHT]),
            "lower_leg": mean_radius(one_leg, SHANK[RIGHT]),
        },
    )


def true_bdp(person: Person) -> Bdp:
    """The person's sizes as the BDP of the ten-part anatomy."""
    sizes = true_sizes(person)
    rows = {
        "torso": (sizes.torso, sizes.torso_half_width, sizes.torso_half_depth),
        "head": (sizes.head, sizes.head_half_width, sizes.head_half_depth),
    }
    offsets = {"neck": (0.0, sizes.torso, 0.0)}
    for side, out in zip(SIDE_NAMES, (-1.0, 1.0), strict=True):
        lengths = (sizes.upper_arm, sizes.lower_arm, sizes.upper_leg, sizes.lower_leg)
        for segment, length in zip(SEGMENTS, lengths, strict=True):
            rows[f"{side}_{segment}"] = (length, sizes.radii[segment], sizes.radii[segment])
        offsets[f"{side}_shoulder"] = (out * sizes.shoulder_half, sizes.torso, 0.0)
        offsets[f"{side}_hip"] = (out * sizes.hip_half, 0.0, 0.0)
        offsets[f"{side}_elbow"] = (0.0, sizes.upper_arm, 0.0)
        offsets[f"{side}_knee"] = (0.0, sizes.upper_leg, 0.0)
    return Bdp(
        np.array([rows[part] for part in TEN_PARTS.parts]),
        np.array([offsets.get(joint.name, (0.0, 0.0, 0.0)) for joint in TEN_PARTS.joints]),
    )


def _joints(person: Person, bones: Bones) -> dict[str, Floats]:
    size, joints = person.lengths, {}
    for side in SIDES:
        letter, forearm = "RL"[side], FOREARM[side]
        joints[f"{letter}Hip"] = bones.origin[THIGH[side]]
        joints[f"{letter}Knee"] = bones.origin[SHANK[side]]
        joints[f"{letter}Ankle"] = bones.origin[FOOT[side]]
        joints[f"{letter}Shoulder"] = bones.origin[UPPER_ARM[side]]
        joints[f"{letter}Elbow"] = bones.origin[forearm]
        joints[f"{letter}Wrist"] = bones.origin[forearm] - size.forearm * bones.rotation[forearm, :, 1]
    joints["Hip"] = 0.5 * (joints["RHip"] + joints["LHip"])
    joints["Neck"] = 0.5 * (joints["RShoulder"] + joints["LShoulder"])
    joints["Head"] = bones.origin[HEAD] + size.head_top * bones.rotation[HEAD, :, 1]
    return {marker.name: joints[marker.name] for marker in TEN_PARTS.markers}


def _torso(joints: Mapping[str, Floats]) -> Floats:
    """Torso to world (3, 3): Y from the hip line to the mid-shoulder, X along the mean of hip line and shoulder line."""
    across = unit(joints["LHip"] - joints["RHip"]) + unit(joints["LShoulder"] - joints["RShoulder"])
    return from_x_and_y(across, joints["Neck"] - joints["Hip"])


def _ten_part_angles(bones: Bones, torso: Floats) -> dict[str, float]:
    angles = dict(zip(("navel.y", "navel.x", "navel.z"), yxz_angles(torso), strict=True))
    head = from_x_and_y(bones.rotation[HEAD, :, 0], bones.rotation[HEAD, :, 1])
    angles |= dict(zip(("neck.z", "neck.x", "neck.y"), zxy_angles(torso.T @ head), strict=True))
    for side in SIDES:
        name = SIDE_NAMES[side]
        for joint, hinge, upper, lower in (
            ("shoulder", "elbow", UPPER_ARM[side], FOREARM[side]),
            ("hip", "knee", THIGH[side], SHANK[side]),
        ):
            middle = {"shoulder": (np.pi / 2, 3 * np.pi / 2)[side], "hip": np.pi}[joint]
            # A simulated bone extends along -Y, a part of the anatomy along +Y: half a turn about Z.
            part = torso.T @ bones.rotation[upper] * np.array([-1.0, -1.0, 1.0])
            values = _nearest_angles(part, middle)
            angles |= {f"{name}_{joint}.{axis}": v for axis, v in zip("zxy", values, strict=True)}
            bend = bones.rotation[upper].T @ bones.rotation[lower]
            angles[f"{name}_{hinge}.x"] = -float(np.arctan2(bend[2, 1], bend[1, 1]))
    return {angle: angles[angle] for angle in TEN_PARTS.angles}


def _nearest_angles(rotation: Floats, middle: float) -> tuple[float, float, float]:
    """Angles (z, x, y) with rotation = Rz Rx Ry: of the two solutions, the one with the smaller |x| + |y|, with z within
    half a turn of `middle`."""
    z, x, y = zxy_angles(rotation)
    mirrored = (z + np.pi, np.pi - x, y + np.pi)

    def wrapped(angles: tuple[float, float, float]) -> tuple[float, float, float]:
        z, x, y = angles
        return (
            middle + float((z - middle + np.pi) % (2 * np.pi) - np.pi),
            float((x + np.pi) % (2 * np.pi) - np.pi),
            float((y + np.pi) % (2 * np.pi) - np.pi),
        )

    return min((wrapped((z, x, y)), wrapped(mirrored)), key=lambda a: abs(a[1]) + abs(a[2]))
