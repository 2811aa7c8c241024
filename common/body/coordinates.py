"""Pose coordinates of prior and particles: rotation vectors of ball joints, angles of hinges.

Euler angles are singular where an arm points forward; a rotation vector relative to the middle of a joint's range is not
singular within the range.  The root (position and orientation in the world) is separate: the prior does not depend on it.
"""

# Paper (replaced): [Hybrid II] has angles about X, Y and Z; here a rotation vector for each ball joint.
# Paper (corrected): 25 DoF by [Hybrid II] are 27D in VI and 33D in VII; the prior learns the joints without the root.

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy, Joint
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import rotate
from zenocap.common.body.rotations import matrix_to_euler, matrix_to_vector, vector_to_matrix

BALL, HINGE = 3, 1


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of all joints of an anatomy except the first, the root.

    names: (dimension,) `right_elbow.x` of a hinge, `right_shoulder.1` ... `.3` of a ball joint.
    first: (joints,) index of a joint's first coordinate; -1 for the root and fixed joints.
    reference: (joints, 3, 3) rotation, part to parent, at which a ball joint's coordinates are zero.
    """

    anatomy: Anatomy
    names: tuple[str, ...]
    first: Ints
    reference: Floats

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    def of_pose(self, pose: Pose) -> Floats:
        """Coordinates (dimension,) of a pose, radians."""
        values, rotation = np.empty(self.dimension), np.empty((3, 3))
        for k, joint in enumerate(self.anatomy.joints):
            start = int(self.first[k])
            if start < 0:
                continue
            if len(joint.axes) == HINGE:
                values[start] = pose.angles[self.anatomy.tree[k, 1]]
            else:
                rotation = self.reference[k].T @ _local(self.anatomy, k, pose.angles)
                matrix_to_vector(rotation, values[start : start + 3])
        return values

    def angles(self, values: Floats, root: Floats) -> Floats:
        """Joint angles (angles,) of coordinates (dimension,) and the root's orientation (3, 3), part to world."""
        angles = np.zeros(len(self.anatomy.angles))
        ball_joints: dict[str, list[tuple[int, Floats, Floats]]] = {}  # by axes: first angle, rotation, near
        for k, joint in enumerate(self.anatomy.joints):
            start, at = int(self.first[k]), int(self.anatomy.tree[k, 1])
            if k == 0:
                ball_joints.setdefault(joint.axes, []).append((at, root, np.zeros(3)))
            elif start >= 0 and len(joint.axes) == HINGE:
                angles[at] = values[start]
            elif start >= 0:
                rotation = np.empty((3, 3))
                vector_to_matrix(values[start : start + 3], rotation)
                middle = np.array([0.5 * (low + high) for low, high in joint.limits])
                ball_joints.setdefault(joint.axes, []).append((at, self.reference[k] @ rotation, middle))
        for axes, joints in ball_joints.items():
            starts, rotations, near = zip(*joints, strict=True)
            for at, three in zip(starts, matrix_to_euler(axes, np.array(rotations), np.array(near)), strict=True):
                angles[at : at + 3] = three
        return angles


@lru_cache
def coordinates_of(anatomy: Anatomy) -> Coordinates:
    """Coordinates of an anatomy whose joints have three axes, one, or none."""
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


def unwrap_rotations(anatomy: Anatomy, coordinates: Floats) -> Floats:
    """Equal rotations (n, d) with every rotation vector as near as possible to the previous row's.

    A rotation by more than half a turn equals a shorter one about the opposite axis; unwrapped motions do not jump there.
    """
    table, result = coordinates_of(anatomy), coordinates.copy()
    for first, joint in zip(table.first, anatomy.joints, strict=True):
        if first < 0 or len(joint.axes) != 3:
            continue
        near = np.zeros(3)
        for row in result[:, first : first + 3]:
            angle = float(np.linalg.norm(row))
            if not np.isfinite(angle):
                continue
            if angle > 1e-9:
                axis = row / angle
                row += 2.0 * np.pi * np.round((float(axis @ near) - angle) / (2.0 * np.pi)) * axis
            near = row
    return result


def _local(anatomy: Anatomy, joint: int, angles: Floats) -> Floats:
    """Rotation (3, 3), part to parent, of a joint at `angles` (angles,) radians."""
    rotation = np.eye(3)
    _, at, *axes = anatomy.tree[joint]
    for n, axis in enumerate(axes):
        if axis >= 0:
            rotate(rotation, axis, angles[at + n])
    return rotation


def _middle(joint: Joint) -> Floats:
    """Rotation (3, 3) at the middle of a ball joint's range: arms half raised forward and sideways, thighs slightly.

    The directions are chosen by hand; trained priors depend on them.
    """
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
    vector_to_matrix(axis, swing)
    hanging = np.diag([-1.0, -1.0, 1.0])  # half a turn about Z
    middle: Floats = swing @ hanging
    return middle
