"""Limbs as directions: a spherical joint and the flexion joint after it, as two unit vectors in the torso's frame.

Two views see a limb's projections, which combine as vectors and not as angles; the joint angles of [Two-view 2.2] follow
from the directions at the end.  Limbs are right arm, left arm, right leg, left leg.
"""

from dataclasses import dataclass

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp

LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")
_JOINTS = (
    ("right_shoulder", "right_elbow"),
    ("left_shoulder", "left_elbow"),
    ("right_hip", "right_knee"),
    ("left_hip", "left_knee"),
)
SINGULAR = np.cos(np.radians(84))  # below this a rotation about the limb's own line is not defined and keeps its value
RESTING = np.array([0.0, -0.995, 0.1])  # a hanging arm in the world, a little to the person's front
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
    for k, limb in enumerate(limbs_of(anatomy)):
        upper_to_torso = _spherical(angles[limb.z], angles[limb.x], angles[limb.y])
        e = angles[limb.flexion]
        directions[k, 0] = upper_to_torso[:, 1]
        directions[k, 1] = upper_to_torso @ np.array([0.0, np.cos(e), np.sin(e)])
    return directions


def limb_angles(anatomy: Anatomy, directions: Floats, previous: Floats) -> Floats:
    """Joint angles (angles,) with the limbs along `directions` (4, 2, 3) in the torso's frame, all others as `previous`.

    Inverts M = Rz Rx Ry: the upper direction is (-sin z cos x, cos z cos x, sin x).  Of the two equal solutions the one
    nearer to `previous` is taken, unless it turns past 150° about X; where an angle is undefined, it keeps its value.
    Results are within the anatomy's limits.
    """
    angles = previous.copy()
    for k, limb in enumerate(limbs_of(anatomy)):
        upper, lower = directions[k]
        z, x = _upper_angles(upper, float(previous[limb.z]), float(previous[limb.x]), anatomy.limits[limb.z])
        forearm = _spherical(z, x, 0.0).T @ lower
        bend = float(np.arccos(np.clip(forearm[1], -1, 1)))
        sign = -1.0 if limb.is_leg else 1.0
        twist = float(np.arctan2(sign * forearm[0], sign * forearm[2]))
        if bend < STRAIGHT:
            twist = float(previous[limb.y])
        angles[limb.z], angles[limb.x], angles[limb.y], angles[limb.flexion] = z, x, twist, sign * bend
    return np.clip(angles, anatomy.limits[:, 0], anatomy.limits[:, 1])


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


def legs_exchanged(directions: Floats) -> Floats:
    """The limbs (4, 2, 3) with the legs' places exchanged front to back, each staying on its own side."""
    other = directions.copy()
    for k, twin in ((2, 3), (3, 2)):
        other[k] = directions[twin]
        other[k, :, 0] = directions[k, :, 0]
        other[k] /= np.linalg.norm(other[k], axis=1, keepdims=True)
    return other


def _spherical(z: float, x: float, y: float) -> Floats:
    cz, sz, cx, sx, cy, sy = np.cos(z), np.sin(z), np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    product: Floats = rz @ rx @ ry
    return product


def _upper_angles(upper: Floats, z_before: float, x_before: float, z_limits: Floats) -> tuple[float, float]:
    x = float(np.arcsin(np.clip(upper[2], -1, 1)))
    if np.hypot(upper[0], upper[1]) < SINGULAR:
        # Forward or backward, z is free; the branch of x follows it.
        return z_before, x
    middle = float(z_limits.mean())
    z = _near(float(np.arctan2(-upper[0], upper[1])), middle)
    other_z, other_x = _near(z + np.pi, middle), _near(np.pi - x, 0.0)
    nearer = abs(other_z - z_before) + abs(other_x - x_before) < abs(z - z_before) + abs(x - x_before)
    outside = not z_limits[0] - 0.35 <= z <= z_limits[1] + 0.35
    if (nearer or outside) and abs(other_x) < np.radians(150):
        return other_z, other_x
    return z, x


def _near(angle: float, middle: float) -> float:
    """The same angle within half a turn of `middle`."""
    return angle + 2 * np.pi * round((middle - angle) / (2 * np.pi))
