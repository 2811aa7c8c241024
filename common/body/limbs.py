"""Limbs as directions: a spherical joint and the flexion joint after it, as two unit vectors in the torso's frame.

Two views see a limb's projections, which combine as vectors and not as angles; the joint angles of [Two-view 2.2] follow
from the directions at the end.  Limbs are right arm, left arm, right leg, left leg.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp
from common.body.kinematics import rotate

LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")
_JOINTS = (
    ("right_shoulder", "right_elbow"),
    ("left_shoulder", "left_elbow"),
    ("right_hip", "right_knee"),
    ("left_hip", "left_knee"),
)
SINGULAR = np.cos(np.radians(84))  # below this a rotation about the limb's own line is not defined and keeps its value
RESTING = np.array([0.0, -0.995, 0.1])  # a hanging arm in the world, a little to the person's front
FURTHEST_X = np.radians(150)  # of the second solution
BEYOND = np.radians(20)  # past its limit z is clipped rather than that the limb takes its other solution
STRAIGHT = np.radians(10)  # under this much bending the twist of the upper part is not seen and keeps its value


@dataclass(frozen=True)
class Limb:
    """Angle and part indices of one limb in an anatomy."""

    name: str
    spherical: str
    z: int
    x: int
    y: int
    flexion: int
    upper: int
    lower: int
    is_leg: bool


@lru_cache
def limbs_of(anatomy: Anatomy) -> tuple[Limb, ...]:
    """The four limbs of an anatomy, ordered as `LIMBS`."""
    index = anatomy.index
    limbs = []
    for name, (spherical, flexion) in zip(LIMBS, _JOINTS, strict=True):
        z, x, y = (index[f"{spherical}.{axis}"] for axis in "zxy")
        bend = index[f"{flexion}.x"]
        limbs.append(Limb(name, spherical, z, x, y, bend, index[spherical], index[flexion], "leg" in name))
    return tuple(limbs)


def limb_directions(anatomy: Anatomy, angles: Floats) -> Floats:
    """(4, 2, 3) unit vectors of every limb's upper and lower part in the torso's frame; angles: (angles,) radians."""
    directions = np.empty((len(LIMBS), 2, 3))
    _directions(_table(anatomy), angles, directions)
    return directions


def limb_angles(anatomy: Anatomy, directions: Floats, previous: Floats) -> Floats:
    """Joint angles (angles,) with the limbs along `directions` (4, 2, 3) in the torso's frame, all others as `previous`.

    Inverts M = Rz Rx Ry: the upper direction is (-sin z cos x, cos z cos x, sin x).  Of the two equal solutions the one
    nearer to `previous` is taken, unless it turns past 150° about X; where an angle is undefined, it keeps its value.
    Results are within the anatomy's limits.
    """
    angles = previous.copy()
    _angles(_table(anatomy), anatomy.limits, directions, angles)
    return angles


def limb_origins(anatomy: Anatomy, bdp: Bdp) -> Floats:
    """(4, 3) shoulders and hips in the torso's frame, metres."""
    return np.stack([bdp.offsets[limb.upper] for limb in limbs_of(anatomy)])


def limb_sizes(anatomy: Anatomy, bdp: Bdp) -> Floats:
    """(4, 2, 3) height, long and short radius of every limb's upper and lower part, metres."""
    return np.stack([bdp.sizes[[limb.upper, limb.lower]] for limb in limbs_of(anatomy)])


def resting_arm(torso_to_world: Floats, yaw: float) -> Floats:
    """(2, 3) directions of a hanging arm in the torso's frame, whatever the torso's lean."""
    front = np.array([RESTING[2] * np.sin(yaw), RESTING[1], RESTING[2] * np.cos(yaw)])
    hanging = torso_to_world.T @ front
    return np.stack([hanging, hanging])


def legs_exchanged(directions: Floats, *, unit: bool = True) -> Floats:
    """The limbs (4, 2, 3) with the legs' places exchanged front to back, each staying on its own side.

    unit: keep directions of unit length.
    """
    other = directions.copy()
    for k, twin in ((2, 3), (3, 2)):
        other[k] = directions[twin]
        other[k, :, 0] = directions[k, :, 0]
        if unit:
            other[k] /= np.linalg.norm(other[k], axis=1, keepdims=True)
    return other


@lru_cache
def _table(anatomy: Anatomy) -> NDArray[np.int64]:
    """(4, 5) for compiled code: angle indices z, x, y and flexion, and whether it is a leg."""
    return np.array([[limb.z, limb.x, limb.y, limb.flexion, limb.is_leg] for limb in limbs_of(anatomy)], dtype=np.int64)


@njit(cache=True, error_model="numpy")
def _rotation(z: float, x: float, y: float, out: Floats) -> None:
    """out (3, 3) = Rz(z) Rx(x) Ry(y)."""
    for row in range(3):
        for column in range(3):
            out[row, column] = 1.0 if row == column else 0.0
    rotate(out, 2, z)
    rotate(out, 0, x)
    rotate(out, 1, y)


@njit(cache=True, error_model="numpy")
def _directions(table: NDArray[np.int64], angles: Floats, directions: Floats) -> None:
    turned = np.empty((3, 3))
    for k in range(table.shape[0]):
        _rotation(angles[table[k, 0]], angles[table[k, 1]], angles[table[k, 2]], turned)
        bend = angles[table[k, 3]]
        for row in range(3):
            directions[k, 0, row] = turned[row, 1]
            directions[k, 1, row] = turned[row, 1] * np.cos(bend) + turned[row, 2] * np.sin(bend)


@njit(cache=True, error_model="numpy")
def _angles(table: NDArray[np.int64], limits: Floats, directions: Floats, angles: Floats) -> None:
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


@njit(cache=True, error_model="numpy")
def _upper_angles(upper: Floats, z_before: float, x_before: float, z_limits: Floats) -> tuple[float, float]:
    x = np.arcsin(min(max(upper[2], -1.0), 1.0))
    if np.hypot(upper[0], upper[1]) < SINGULAR:
        return z_before, x  # forward or backward, z is free
    middle = (z_limits[0] + z_limits[1]) / 2
    z = _near(np.arctan2(-upper[0], upper[1]), middle)
    other_z, other_x = _near(z + np.pi, middle), _near(np.pi - x, 0.0)
    nearer = abs(other_z - z_before) + abs(other_x - x_before) < abs(z - z_before) + abs(x - x_before)
    if (nearer or _outside(z, z_limits)) and not _outside(other_z, z_limits) and abs(other_x) < FURTHEST_X:
        return other_z, other_x
    return z, x


@njit(cache=True, error_model="numpy")
def _outside(z: float, limits: Floats) -> bool:
    return bool(z < limits[0] - BEYOND or z > limits[1] + BEYOND)


@njit(cache=True, error_model="numpy")
def _near(angle: float, middle: float) -> float:
    """The same angle within half a turn of `middle`."""
    return float(angle + 2 * np.pi * np.round((middle - angle) / (2 * np.pi)))
