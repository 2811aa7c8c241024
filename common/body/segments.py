"""Torso angles, and limbs as directions in the torso's frame.  [Two-view 2.2]

A limb is a spherical joint and the flexion joint after it: two unit vectors in the torso's frame.  Projections of two
views combine as vectors and not as angles, so joint angles are computed from the directions at the end.  Limbs are
right arm, left arm, right leg, left leg.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.body.kinematics import rotate
from zenocap.common.jit import kernel

LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")
_JOINTS = (
    ("right_shoulder", "right_elbow"),
    ("left_shoulder", "left_elbow"),
    ("right_hip", "right_knee"),
    ("left_hip", "left_knee"),
)

# All values below are chosen by hand.
YAW_OFFSETS = np.radians([-16.0, -8.0, 0.0, 8.0, 16.0])  # of the torso, at which viewers report matching scores
LOW_SHARE, HIGH_SHARE = 0.35, 0.65  # th_low and th_high between the width in FLANK (0) and in FACADE (1)
SINGULAR = np.cos(np.radians(84))  # horizontal length of a unit direction below which z is undefined and keeps its value
HANGING_ARM = np.array([0.0, -0.995, 0.1])  # direction in the world of a hanging arm of a person who faces +Z
MAX_SECOND_X = np.radians(150)  # largest |x| of the second solution
MAX_EXCESS = np.radians(20)  # excess of z over its limits that is clipped; beyond it the second solution is preferred
STRAIGHT = np.radians(10)  # flexion below which the axial rotation y is unobservable and keeps its value


def torso_rotation(yaw: float, lean: float, roll: float) -> Floats:
    """Rotation (3, 3) of the torso's frame to the world, M_W^N = Ry(yaw) Rx(lean) Rz(roll).  [Two-view 2.2 (1)]

    yaw: from +Z towards +X.  lean: forward.  roll: to the person's right.  Radians.
    """
    cy, sy, cx, sx, cz, sz = np.cos(yaw), np.sin(yaw), np.cos(lean), np.sin(lean), np.cos(roll), np.sin(roll)
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    # Paper (open): 2.2 (1) prints Ry Rx only, though 2.1 counts three angles of the navel; the third is last.
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rotation: Floats = ry @ rx @ rz
    return rotation


def lean_and_roll(spine: Floats, yaw: float) -> tuple[float, float]:
    """Return (lean, roll), radians, at which the torso's +Y is the unit vector `spine` (3,) of the world, given yaw."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = c * spine[0] - s * spine[2], spine[1], s * spine[0] + c * spine[2]
    return float(np.arctan2(z, y)), float(-np.arcsin(np.clip(x, -1, 1)))


def width_thresholds(flank_width: float, facade_width: float) -> tuple[float, float]:
    """Thresholds (th_low, th_high) of the upper body's width, in the unit of both widths.  [Two-view 3.1]

    flank_width, facade_width: of the T-pose.
    """
    # Paper (open): 3.1 gives no values of th_low and th_high; here 35 % and 65 % of the way from flank to facade.
    gap = facade_width - flank_width
    return flank_width + LOW_SHARE * gap, flank_width + HIGH_SHARE * gap


@dataclass(frozen=True)
class Limb:
    """Angle and part indices of one limb in an anatomy."""

    name: str
    z: int
    x: int
    y: int
    flexion: int
    upper: int
    lower: int
    is_leg: bool


@lru_cache
def limbs_of(anatomy: Anatomy) -> tuple[Limb, ...]:
    """The four limbs of an anatomy, in the order of `LIMBS`."""
    index = anatomy.index
    limbs = []
    for name, (spherical, flexion) in zip(LIMBS, _JOINTS, strict=True):
        z, x, y = (index[f"{spherical}.{axis}"] for axis in "zxy")
        bend = index[f"{flexion}.x"]
        limbs.append(Limb(name, z, x, y, bend, index[spherical], index[flexion], "leg" in name))
    return tuple(limbs)


def limb_directions(anatomy: Anatomy, angles: Floats) -> Floats:
    """Unit vectors (4, 2, 3) along every limb's upper and lower part in the torso's frame; angles: (angles,) radians."""
    directions = np.empty((len(LIMBS), 2, 3))
    _directions(_table(anatomy), angles, directions)
    return directions


def limb_angles(anatomy: Anatomy, directions: Floats, previous: Floats) -> Floats:
    """Joint angles (angles,) of limbs along `directions` (4, 2, 3) in the torso's frame; all others as in `previous`.

    Inverts M = Rz Rx Ry: the upper direction is (-sin z cos x, cos z cos x, sin x).  Of the two solutions the one nearer
    to `previous` is returned, unless its |x| exceeds 150°.  Undefined angles keep their previous value.  Results are
    within the anatomy's limits.
    """
    angles = previous.copy()
    _angles(_table(anatomy), anatomy.limits, directions, angles)
    return angles


def limb_origins(anatomy: Anatomy, bdp: Bdp) -> Floats:
    """Positions (4, 3) of shoulders and hips in the torso's frame, metres."""
    return np.stack([bdp.offsets[limb.upper] for limb in limbs_of(anatomy)])


def limb_sizes(anatomy: Anatomy, bdp: Bdp) -> Floats:
    """Height, long and short radius (4, 2, 3) of every limb's upper and lower part, metres."""
    return np.stack([bdp.sizes[[limb.upper, limb.lower]] for limb in limbs_of(anatomy)])


def hanging_arm(torso_to_world: Floats, yaw: float) -> Floats:
    """Directions (2, 3) in the torso's frame of an arm that hangs vertically, given torso rotation (3, 3) and yaw."""
    front = np.array([HANGING_ARM[2] * np.sin(yaw), HANGING_ARM[1], HANGING_ARM[2] * np.cos(yaw)])
    hanging = torso_to_world.T @ front
    return np.stack([hanging, hanging])


def exchange_legs(directions: Floats) -> Floats:
    """Limb directions (4, 2, 3) with both legs' vertical and forward components exchanged; sideways ones are kept."""
    other = directions.copy()
    for k, opposite in ((2, 3), (3, 2)):
        other[k] = directions[opposite]
        other[k, :, 0] = directions[k, :, 0]
        other[k] /= np.linalg.norm(other[k], axis=1, keepdims=True)
    return other


@lru_cache
def _table(anatomy: Anatomy) -> Ints:
    """(4, 5) for compiled code: angle indices z, x, y and flexion, and 1 for legs."""
    return np.array([[limb.z, limb.x, limb.y, limb.flexion, limb.is_leg] for limb in limbs_of(anatomy)], dtype=np.int64)


@kernel
def _rotation(z: float, x: float, y: float, out: Floats) -> None:
    """out (3, 3) = Rz(z) Rx(x) Ry(y)."""
    for row in range(3):
        for column in range(3):
            out[row, column] = 1.0 if row == column else 0.0
    rotate(out, 2, z)
    rotate(out, 0, x)
    rotate(out, 1, y)


@kernel
def _directions(table: Ints, angles: Floats, directions: Floats) -> None:
    turned = np.empty((3, 3))
    for k in range(table.shape[0]):
        _rotation(angles[table[k, 0]], angles[table[k, 1]], angles[table[k, 2]], turned)
        bend = angles[table[k, 3]]
        for row in range(3):
            directions[k, 0, row] = turned[row, 1]
            directions[k, 1, row] = turned[row, 1] * np.cos(bend) + turned[row, 2] * np.sin(bend)


@kernel
def _angles(table: Ints, limits: Floats, directions: Floats, angles: Floats) -> None:
    turned = np.empty((3, 3))
    for k in range(table.shape[0]):
        z, x = _upper_angles(directions[k, 0], angles[table[k, 0]], angles[table[k, 1]], limits[table[k, 0]])
        _rotation(z, x, 0.0, turned)
        lower = turned.T @ directions[k, 1]
        bend = np.arccos(min(max(lower[1], -1.0), 1.0))
        sign = -1.0 if table[k, 4] else 1.0
        if bend >= STRAIGHT:
            angles[table[k, 2]] = np.arctan2(sign * lower[0], sign * lower[2])
        angles[table[k, 0]], angles[table[k, 1]], angles[table[k, 3]] = z, x, sign * bend
        for column in range(4):
            at = table[k, column]
            angles[at] = min(max(angles[at], limits[at, 0]), limits[at, 1])


@kernel
def _upper_angles(upper: Floats, z_before: float, x_before: float, z_limits: Floats) -> tuple[float, float]:
    x = np.arcsin(min(max(upper[2], -1.0), 1.0))
    if np.hypot(upper[0], upper[1]) < SINGULAR:
        return z_before, x  # straight forward or backward
    middle = (z_limits[0] + z_limits[1]) / 2
    z = _near(np.arctan2(-upper[0], upper[1]), middle)
    other_z, other_x = _near(z + np.pi, middle), _near(np.pi - x, 0.0)
    nearer = abs(other_z - z_before) + abs(other_x - x_before) < abs(z - z_before) + abs(x - x_before)
    if (nearer or _outside(z, z_limits)) and not _outside(other_z, z_limits) and abs(other_x) < MAX_SECOND_X:
        return other_z, other_x
    return z, x


@kernel
def _outside(z: float, limits: Floats) -> bool:
    return bool(z < limits[0] - MAX_EXCESS or z > limits[1] + MAX_EXCESS)


@kernel
def _near(angle: float, middle: float) -> float:
    """`angle` modulo a full turn, within half a turn of `middle`."""
    return float(angle + 2 * np.pi * np.round((middle - angle) / (2 * np.pi)))
