"""A pose as the prior and the particles have it: one rotation vector a ball joint, one angle a hinge.

Euler angles are singular where an arm points to the front; a rotation vector from the middle of a joint's range is not
within it.  The root (position and orientation in the world) is kept apart: what is learnt does not depend on the lab.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats, Joint
from common.body.definition import Pose
from common.body.kinematics import rotate
from common.body.rotation_vectors import rotation_of, vector_of

BALL, HINGE = 3, 1


@dataclass(frozen=True, eq=False)
class Coordinates:
    """The coordinates of an anatomy; all joints but the first, which is the root.

    names: (dimension,) `right_elbow.x` of a hinge, `right_shoulder.1` ... `.3` of a ball joint.
    first: (joints,) index of a joint's first coordinate, -1 for the root and rigid joints.
    reference: (joints, 3, 3) the rotation, part to parent, at which a ball joint's coordinates are zero.
    """

    anatomy: Anatomy
    names: tuple[str, ...]
    first: NDArray[np.int64]
    reference: Floats

    @property
    def dimension(self) -> int:
        return len(self.names)

    def of_pose(self, pose: Pose) -> Floats:
        """(dimension,) radians."""
        values, rotation = np.empty(self.dimension), np.empty((3, 3))
        for k, joint in enumerate(self.anatomy.joints):
            start = int(self.first[k])
            if start < 0:
                continue
            if len(joint.axes) == HINGE:
                values[start] = pose.angles[self.anatomy.tree[k, 1]]
            else:
                rotation = self.reference[k].T @ _local(self.anatomy, k, pose.angles)
                vector_of(rotation, values[start : start + 3])
        return values

    def angles(self, values: Floats, root: Floats) -> Floats:
        """The anatomy's angles, of coordinates (dimension,) and the root's orientation (3, 3), part to world."""
        angles = np.zeros(len(self.anatomy.angles))
        rotation = np.empty((3, 3))
        for k, joint in enumerate(self.anatomy.joints):
            start, at = int(self.first[k]), int(self.anatomy.tree[k, 1])
            if k == 0:
                angles[at : at + 3] = euler(joint.axes, root, angles[at : at + 3])
            elif start >= 0 and len(joint.axes) == HINGE:
                angles[at] = values[start]
            elif start >= 0:
                rotation_of(values[start : start + 3], rotation)
                middle = np.array([0.5 * (low + high) for low, high in joint.limits])
                angles[at : at + 3] = euler(joint.axes, self.reference[k] @ rotation, middle)
        return angles


@lru_cache
def coordinates_of(anatomy: Anatomy) -> Coordinates:
    """The coordinates of an anatomy whose joints have three axes, one, or none."""
    names: list[str] = []
    first = np.full(len(anatomy.joints), -1, dtype=np.int64)
    reference = np.tile(np.eye(3), (len(anatomy.joints), 1, 1))
    for k, joint in enumerate(anatomy.joints[1:], 1):
        if not joint.axes:
            continue
        first[k] = len(names)
        if len(joint.axes) == HINGE:
            names.append(f"{joint.name}.{joint.axes}")
        else:
            names += [f"{joint.name}.{n}" for n in (1, 2, 3)]
            reference[k] = _middle(joint)
    return Coordinates(anatomy, tuple(names), first, reference)


def euler(axes: str, rotation: Floats, near: Floats) -> Floats:
    """Angles (3,) about three different axes, first outermost, of a rotation (3, 3); of the two solutions and all whole
    turns the one nearest to `near` (3,)."""
    i, j, k = ("xyz".index(axis) for axis in axes)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    middle = np.arcsin(np.clip(sign * rotation[i, k], -1.0, 1.0))
    outer = np.arctan2(-sign * rotation[j, k], rotation[k, k])
    inner = np.arctan2(-sign * rotation[i, j], rotation[i, i])
    found = []
    for solution in ((outer, middle, inner), (outer + np.pi, np.pi - middle, inner + np.pi)):
        angles = np.array(solution)
        angles -= 2 * np.pi * np.round((angles - near) / (2 * np.pi))
        found.append(angles)
    best: Floats = min(found, key=lambda angles: float(np.sum((angles - near) ** 2)))
    return best


def _local(anatomy: Anatomy, joint: int, angles: Floats) -> Floats:
    """(3, 3) part to parent."""
    rotation = np.eye(3)
    _, at, *axes = anatomy.tree[joint]
    for n, axis in enumerate(axes):
        if axis >= 0:
            rotate(rotation, axis, angles[at + n])
    return rotation


def _middle(joint: Joint) -> Floats:
    """The rotation at the middle of a ball joint's range: arms half raised to the front and side, thighs a little."""
    side = -1.0 if joint.name.startswith("right_") else 1.0
    if "shoulder" in joint.name:
        direction = np.array([0.5 * side, -0.6, 0.6])
    elif "hip" in joint.name:
        direction = np.array([0.1 * side, -0.85, 0.5])
    else:
        return np.eye(3)
    direction /= np.linalg.norm(direction)
    down = np.array([0.0, -1.0, 0.0])
    axis = np.cross(down, direction)
    axis *= np.arccos(float(down @ direction)) / np.linalg.norm(axis)
    swing = np.empty((3, 3))
    rotation_of(axis, swing)
    hanging = np.diag([-1.0, -1.0, 1.0])  # half a turn about Z
    middle: Floats = swing @ hanging
    return middle
