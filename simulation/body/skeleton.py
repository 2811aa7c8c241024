"""Skeleton of the simulated person: bones in the world, with planted legs."""

from dataclasses import dataclass
from math import acos, cos, exp, log, sin, sqrt

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import OUTWARD, SIDES, Arm, Foot, Pelvis, PersonPose, minimum_jerk
from zenocap.simulation.body.rotation import blend, cross, from_x_and_y, rx, ry, rz, unit

PELVIS, CHEST, HEAD = 0, 1, 2
UPPER_ARM, FOREARM = (3, 5), (4, 6)
THIGH, SHANK, FOOT = (7, 10), (8, 11), (9, 12)
BONES = 13

WAIST = 0.42  # height of the spine's bend between hip line and shoulder line
BALL = 0.62  # distance from the ankle to the ball of the foot, in foot lengths without the heel
STRETCHED = 0.9985  # largest hip-ankle distance of a planted leg, relative to its length
SOFTNESS_M = 0.003


@dataclass(frozen=True)
class Bones:
    """Bones in the world, in the order of the bone indices of this file.

    rotation: (13, 3, 3) bone to world; a bone extends along -Y, X is to the person's left, Z to the front.
    origin: (13, 3) proximal joint, metres.  The head's origin is the base of the neck.
    """

    rotation: Floats
    origin: Floats


def rest_bones(person: Person) -> Bones:
    """The skeleton of the rest surface: upright, limbs straight down, all rotations zero."""
    size = person.lengths
    hip_height = size.ankle_height + size.shank + size.thigh
    origin = np.zeros((BONES, 3))
    origin[PELVIS, 1] = hip_height
    origin[CHEST, 1] = hip_height + WAIST * size.torso
    origin[HEAD, 1] = hip_height + size.torso
    for side in SIDES:
        shoulder, hip = OUTWARD[side] * size.shoulder_half, OUTWARD[side] * size.hip_half
        origin[UPPER_ARM[side]] = shoulder, hip_height + size.torso, 0.0
        origin[FOREARM[side]] = shoulder, hip_height + size.torso - size.upper_arm, 0.0
        origin[THIGH[side]] = hip, hip_height, 0.0
        origin[SHANK[side]] = hip, hip_height - size.thigh, 0.0
        origin[FOOT[side]] = hip, size.ankle_height, 0.0
    return Bones(np.tile(np.eye(3), (BONES, 1, 1)), origin)


def pose_bones(person: Person, pose: PersonPose | Bones) -> Bones:
    """The skeleton of a person in a pose; of one whose bones are given, these."""
    if isinstance(pose, Bones):
        return pose
    bones = Bones(np.empty((BONES, 3, 3)), np.empty((BONES, 3)))
    ankles = np.array([_planted_ankle(person, pose, side) for side in SIDES])
    pelvis = ry(pose.pelvis[Pelvis.YAW]) @ rx(pose.pelvis[Pelvis.TILT]) @ rz(-pose.pelvis[Pelvis.ROLL])
    bones.rotation[PELVIS] = pelvis
    bones.origin[PELVIS] = pose.pelvis[Pelvis.X], 0.0, pose.pelvis[Pelvis.Z]
    bones.origin[PELVIS, 1] = _pelvis_height(person, pose, ankles, pelvis)
    for side in SIDES:
        _place_leg(person, pose, side, ankles[side], bones)
    flexion, bend, twist = pose.spine
    chest = pelvis @ rx(flexion) @ rz(-bend) @ ry(twist)
    torso = person.lengths.torso
    bones.rotation[CHEST] = chest
    bones.origin[CHEST] = bones.origin[PELVIS] + pelvis[:, 1] * (WAIST * torso)
    neck_base = bones.origin[CHEST] + chest[:, 1] * ((1.0 - WAIST) * torso)
    bones.rotation[HEAD] = chest @ ry(pose.head[1]) @ rx(pose.head[0])
    bones.origin[HEAD] = neck_base
    for side in SIDES:
        _place_arm(person, pose, side, neck_base, bones)
    return bones


def _planted_ankle(person: Person, pose: PersonPose, side: int) -> Floats:
    foot = pose.feet[side]
    heel = max(float(foot[Foot.HEEL]), 0.0)  # toes that point up do not move the ankle
    ball, ankle = BALL * person.lengths.foot, person.lengths.ankle_height
    forward = ball * (1.0 - cos(heel)) + ankle * sin(heel)
    up = ball * sin(heel) + ankle * (cos(heel) - 1.0)
    yaw = float(foot[Foot.YAW])
    return np.array([foot[Foot.X] + forward * sin(yaw), ankle + foot[Foot.LIFT] + up, foot[Foot.Z] + forward * cos(yaw)])


def _pelvis_height(person: Person, pose: PersonPose, ankles: Floats, pelvis: Floats) -> float:
    """Standing height minus the pose's drop, with a soft limit at the reach of both legs."""
    size = person.lengths
    leg = STRETCHED * (size.thigh + size.shank)
    heights = [size.ankle_height + leg - float(pose.pelvis[Pelvis.DROP])]
    x, z = pose.pelvis[Pelvis.X], pose.pelvis[Pelvis.Z]
    for side in SIDES:
        hip = pelvis[:, 0] * (OUTWARD[side] * size.hip_half)
        apart = float(np.hypot(x + hip[0] - ankles[side, 0], z + hip[2] - ankles[side, 2]))
        heights.append(float(ankles[side, 1]) + sqrt(max(leg**2 - apart**2, 0.01)) - float(hip[1]))
    low = min(heights)
    return low - SOFTNESS_M * log(sum(exp((low - h) / SOFTNESS_M) for h in heights))


def _place_leg(person: Person, pose: PersonPose, side: int, ankle: Floats, bones: Bones) -> None:
    size, pelvis, out = person.lengths, bones.rotation[PELVIS], OUTWARD[side]
    hip = bones.origin[PELVIS] + pelvis[:, 0] * (out * size.hip_half)
    foot_yaw = float(pose.feet[side, Foot.YAW])
    knee_heading = ry(0.5 * (float(pose.pelvis[Pelvis.YAW]) + foot_yaw))
    to_ankle = ankle - hip
    reach = min(float(np.linalg.norm(to_ankle)), 0.99995 * (size.thigh + size.shank))
    down = unit(to_ankle)
    hinge = cross(-down, knee_heading @ np.array([0.08 * out, 0.0, 1.0]))
    cosine = (size.thigh**2 + reach**2 - size.shank**2) / (2.0 * size.thigh * reach)
    at_hip = acos(min(max(cosine, -1.0), 1.0))
    at_knee = acos(min(max((size.thigh**2 + size.shank**2 - reach**2) / (2.0 * size.thigh * size.shank), -1.0), 1.0))
    thigh = from_x_and_y(hinge, -down) @ rx(-at_hip)
    flexion, apart, knee = pose.swing[side]
    swung = pelvis @ rz(out * apart) @ rx(-flexion) @ pelvis.T
    thigh = swung @ thigh
    shank = thigh @ rx(np.pi - at_knee + knee)
    planted = ry(foot_yaw) @ rx(pose.feet[side, Foot.HEEL])
    # A lifted foot rotates with the shank, with the toes slightly down.
    lifted = minimum_jerk((abs(float(flexion)) + 0.6 * abs(float(knee)) + abs(float(apart))) / 0.6)
    knee_at = hip - thigh[:, 1] * size.thigh
    bones.rotation[THIGH[side]], bones.origin[THIGH[side]] = thigh, hip
    bones.rotation[SHANK[side]], bones.origin[SHANK[side]] = shank, knee_at
    bones.rotation[FOOT[side]] = blend(planted, shank @ rx(0.15), lifted)
    bones.origin[FOOT[side]] = knee_at - shank[:, 1] * size.shank


def _place_arm(person: Person, pose: PersonPose, side: int, neck_base: Floats, bones: Bones) -> None:
    size, chest, out = person.lengths, bones.rotation[CHEST], OUTWARD[side]
    arm = pose.arms[side]
    raised = 0.5 - 0.5 * cos(arm[Arm.ABDUCTION]) * cos(arm[Arm.FLEXION])
    shoulder = neck_base + chest @ collar(person, side, raised)
    upper = chest @ rz(out * arm[Arm.ABDUCTION]) @ rx(-arm[Arm.FLEXION]) @ ry(out * arm[Arm.ROTATION])
    bones.rotation[UPPER_ARM[side]] = upper
    bones.origin[UPPER_ARM[side]] = shoulder
    bones.rotation[FOREARM[side]] = upper @ rx(-arm[Arm.ELBOW])
    bones.origin[FOREARM[side]] = shoulder - upper[:, 1] * size.upper_arm


def collar(person: Person, side: int, raised: float) -> Floats:
    """Shoulder joint (3,) relative to the base of the neck, in the chest's frame.  raised: 0 hanging arm, 1 overhead."""
    size = person.lengths
    return np.array([OUTWARD[side] * size.shoulder_half * (1.0 - 0.12 * raised), 0.10 * size.torso * raised**1.5, 0.0])
