"""Two-bone inverse kinematics of an arm: joint angles that bring the wrist to a point."""

from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import OUTWARD, PersonPose
from zenocap.simulation.body.rotation import cross, unit, zxy_angles
from zenocap.simulation.body.skeleton import CHEST, HEAD, UPPER_ARM, Bones, pose_bones

FURTHEST, NEAREST = 0.985, 0.35  # limits of the distance from shoulder to wrist, relative to the arm's length
ROUNDS = 3  # iterations, because the shoulder moves with the arm


@dataclass(frozen=True)
class ArmGoal:
    """wrist: (3,) target position.  elbow: (3,) direction of the elbow from the line through shoulder and wrist.

    Both in the chest's axes (X to the person's left, Y up, Z to the front), origin at the base of the neck; metres.
    """

    wrist: Floats
    elbow: Floats


def reach_goal(person: Person, pose: PersonPose, side: int, goal: ArmGoal) -> PersonPose:
    """The pose with one arm at its goal, or as near as the arm's length allows."""
    for _ in range(ROUNDS):
        bones = pose_bones(person, pose)
        shoulder = bones.rotation[CHEST].T @ (bones.origin[UPPER_ARM[side]] - bones.origin[HEAD])
        arms = pose.arms.copy()
        arms[side] = _angles(person, side, goal.wrist - shoulder, goal.elbow)
        pose = replace(pose, arms=arms)
    return pose


def in_chest(bones: Bones, point: Floats) -> Floats:
    """Convert a world point (3,) to the coordinates of `ArmGoal`."""
    seen: Floats = bones.rotation[CHEST].T @ (point - bones.origin[HEAD])
    return seen


def _angles(person: Person, side: int, to_wrist: Floats, elbow: Floats) -> Floats:
    """Angles (4,) of one arm, its row of `PersonPose.arms`."""
    upper, fore = person.lengths.upper_arm, person.lengths.forearm
    distance = float(np.clip(np.linalg.norm(to_wrist), NEAREST * (upper + fore), FURTHEST * (upper + fore)))
    line = unit(to_wrist)
    off = unit(elbow - (elbow @ line) * line)
    cosine = (upper**2 + distance**2 - fore**2) / (2.0 * upper * distance)
    along = unit(cosine * line + np.sqrt(max(1.0 - cosine**2, 0.0)) * off)
    y = -along  # a bone extends along -Y, and the elbow bends it towards its Z
    towards = -off
    z = unit(towards - (towards @ y) * y)
    about_z, about_x, about_y = zxy_angles(np.array([cross(y, z), y, z]).T)
    bend = np.pi - np.arccos(np.clip((upper**2 + fore**2 - distance**2) / (2.0 * upper * fore), -1.0, 1.0))
    return np.array([OUTWARD[side] * about_z, -about_x, OUTWARD[side] * about_y, bend])
