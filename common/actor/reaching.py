"""An arm that reaches for a point: the joint angles that bring the wrist there."""

from dataclasses import dataclass, replace

import numpy as np

from common.actor.person import Person
from common.actor.pose import ABDUCTION, ELBOW, FLEXION, OUTWARD, ROTATION, ActorPose
from common.actor.rotation import Floats, cross, unit, zxy_angles
from common.actor.skeleton import CHEST, HEAD, UPPER_ARM, Bones, pose_bones

FURTHEST, NEAREST = 0.985, 0.35  # of the arm's length between shoulder and wrist
ROUNDS = 3  # the shoulder itself goes with the arm


@dataclass(frozen=True)
class Reach:
    """wrist: (3,) wanted place.  elbow: (3,) where the elbow points to, seen from the line of shoulder and wrist.

    Both in the chest's axes (X to the person's left, Y up, Z to the front) and from the base of the neck; metres.
    """

    wrist: Floats
    elbow: Floats


def reaching(person: Person, pose: ActorPose, side: int, goal: Reach) -> ActorPose:
    """The pose with one arm at its goal, as near as the arm's length allows."""
    for _ in range(ROUNDS):
        bones = pose_bones(person, pose)
        shoulder = bones.rotation[CHEST].T @ (bones.origin[UPPER_ARM[side]] - bones.origin[HEAD])
        arms = pose.arms.copy()
        arms[side] = _angles(person, side, goal.wrist - shoulder, goal.elbow)
        pose = replace(pose, arms=arms)
    return pose


def in_chest(bones: Bones, point: Floats) -> Floats:
    """A point of the world (3,) in the axes of `Reach`."""
    seen: Floats = bones.rotation[CHEST].T @ (point - bones.origin[HEAD])
    return seen


def _angles(person: Person, side: int, to_wrist: Floats, elbow: Floats) -> Floats:
    """(4,) the arm's row of `ActorPose.arms`."""
    upper, fore = person.lengths.upper_arm, person.lengths.forearm
    distance = float(np.clip(np.linalg.norm(to_wrist), NEAREST * (upper + fore), FURTHEST * (upper + fore)))
    line = unit(to_wrist)
    off = unit(elbow - (elbow @ line) * line)
    cosine = (upper**2 + distance**2 - fore**2) / (2.0 * upper * distance)
    along = unit(cosine * line + np.sqrt(max(1.0 - cosine**2, 0.0)) * off)
    y = -along  # a bone hangs along -Y, and its hinge bends it to its Z
    towards = -off
    z = unit(towards - (towards @ y) * y)
    about_z, about_x, about_y = zxy_angles(np.array([cross(y, z), y, z]).T)
    bend = np.pi - np.arccos(np.clip((upper**2 + fore**2 - distance**2) / (2.0 * upper * fore), -1.0, 1.0))
    row = np.empty(4)
    row[[ABDUCTION, FLEXION, ROTATION, ELBOW]] = OUTWARD[side] * about_z, -about_x, OUTWARD[side] * about_y, bend
    return row
