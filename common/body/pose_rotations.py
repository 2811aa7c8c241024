"""Poses for filters: a unit quaternion for each ball joint and the root, an angle for each hinge.

Euler angles jump where they wrap and are singular where an arm points forward.  The components of quaternions whose signs
are continuous do not, and a linear filter of them, scaled to length 1 again, gives the same motion in every world frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import BALL, HINGE
from zenocap.common.body.rotations import euler_to_matrix, matrix_to_euler, matrix_to_quaternion

# A faster change of the root was no motion, but a correction of the track.  12 m/s is faster than a sprint, and 25 rad/s,
# four turns a second, faster than a figure skater's start of a spin.  Chosen by hand; the tracker has the same limits.
MAX_SPEED, MAX_TURN_RATE = 12.0, 25.0  # m/s, rad/s


@dataclass(frozen=True, eq=False)
class PoseRotations:
    """n poses.  positions: (n, 3) navel, metres.  quaternions: (n, balls, 4) x, y, z, w, part to parent, the root first.

    hinges: (n, hinges) radians.  Joints are in the order of the anatomy.
    """

    positions: Floats
    quaternions: Floats
    hinges: Floats


@dataclass(frozen=True, eq=False)
class JointColumns:
    """Columns of a pose's angles.  balls: by axes, ball joints and (joints, 3) their angles.  hinges: (hinges,).

    count: of ball joints.  limits: (hinges, 2) radians.
    """

    count: int
    balls: Mapping[str, tuple[Ints, Ints]]
    hinges: Ints
    limits: Floats


@lru_cache
def joint_columns(anatomy: Anatomy) -> JointColumns:
    """Columns of an anatomy whose joints have three axes, one, or none."""
    found: dict[str, list[tuple[int, int]]] = {}
    hinges, count = [], 0
    for k, joint in enumerate(anatomy.joints):
        at = int(anatomy.tree[k, 1])
        if len(joint.axes) == BALL:
            found.setdefault(joint.axes, []).append((count, at))
            count += 1
        elif len(joint.axes) == HINGE:
            hinges.append(at)
    balls = {
        axes: (np.array([ball for ball, _ in joints]), np.array([[at, at + 1, at + 2] for _, at in joints]))
        for axes, joints in found.items()
    }
    columns = np.array(hinges, dtype=np.int64)
    return JointColumns(count, balls, columns, anatomy.limits[columns])


def pose_rotations(anatomy: Anatomy, positions: Floats, angles: Floats) -> PoseRotations:
    """Rotations of poses: positions (n, 3), angles (n, angles) in radians; signs of quaternions are continuous over n."""
    columns = joint_columns(anatomy)
    quaternions = np.empty((len(angles), columns.count, 4))
    for axes, (balls, at) in columns.balls.items():
        matrices = euler_to_matrix(axes, angles[:, at])
        quaternions[:, balls] = matrix_to_quaternion(matrices.reshape(-1, 3, 3)).reshape(len(angles), -1, 4)
    opposite = np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0.0
    quaternions[1:] *= np.where(np.cumsum(opposite, axis=0) % 2 == 1, -1.0, 1.0)[..., None]
    return PoseRotations(positions, quaternions, angles[:, columns.hinges])


def joint_angles(anatomy: Anatomy, rotations: PoseRotations, near: Floats) -> Floats:
    """Joint angles (n, angles), radians, of rotations; of equal Euler angles those nearest to `near` (n, angles)."""
    columns = joint_columns(anatomy)
    angles = near.copy()
    for axes, (balls, at) in columns.balls.items():
        matrices = Rotation.from_quat(rotations.quaternions[:, balls].reshape(-1, 4)).as_matrix()
        found = matrix_to_euler(axes, np.asarray(matrices, dtype=np.float64), near[:, at].reshape(-1, 3))
        angles[:, at] = found.reshape(len(near), -1, 3)
    angles[:, columns.hinges] = rotations.hinges
    return angles


def root_jumps(rotations: PoseRotations, times_s: Floats) -> Bools:
    """(n - 1,) whether the root moved or turned faster than a person can.  times_s: (n,) seconds."""
    steps_s = np.diff(times_s)
    speed = np.linalg.norm(np.diff(rotations.positions, axis=0), axis=1)
    cosines = np.abs(np.sum(rotations.quaternions[1:, 0] * rotations.quaternions[:-1, 0], axis=-1))
    turn = 2.0 * np.arccos(np.minimum(cosines, 1.0))
    jumps: Bools = (speed > MAX_SPEED * steps_s) | (turn > MAX_TURN_RATE * steps_s)
    return jumps
