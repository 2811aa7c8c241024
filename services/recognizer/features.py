"""Feature vector of a pose: ten angles of limbs relative to the torso.  [Two-view 5.1]

Two kinds.  `joint-angles` is the paper's: θ_x and θ_z of shoulders and hips and θ_x of the elbows, as tracked.  They are
singular where an arm points forwards, and a bent arm has two sets of values (θ_y = ±90° with the elbow either way).
`directions` is the default: directions of upper arms and thighs as arcs on the sphere from the middle of their range, and
the flexion of the elbows.
"""

from collections.abc import Callable, Mapping
from typing import Literal, get_args

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.rotations import euler_to_matrix, perpendicular, unit
from zenocap.services.recognizer.parameters import HIP_MIDDLE, SHOULDER_MIDDLE, WAIST_SHARE

Kind = Literal["directions", "joint-angles"]
KINDS: tuple[Kind, ...] = get_args(Kind)
# Paper (replaced): 5.1 uses theta_x and theta_z, which jump where an arm points forwards.
DEFAULT: Kind = "directions"

NAMES = (
    "right_shoulder.x", "right_shoulder.z", "left_shoulder.x", "left_shoulder.z", "right_elbow.x", "left_elbow.x",
    "right_hip.x", "right_hip.z", "left_hip.x", "left_hip.z",
)  # fmt: skip
MIDDLES: Mapping[str, tuple[float, float, float]] = {"shoulder": SHOULDER_MIDDLE, "hip": HIP_MIDDLE}


def features_of(anatomy: Anatomy, angles: Floats, kind: Kind = DEFAULT) -> Floats:
    """Feature vectors (..., 10) in radians, in the order of NAMES, of poses of `ten-parts` or `fourteen-parts`.

    angles: (..., angles) radians in the order of `Anatomy.angles`; NaN gives NaN.  Raises ValueError for another anatomy
    or shape.
    """
    if anatomy not in (TEN_PARTS, FOURTEEN_PARTS):
        raise ValueError(f"anatomy {anatomy.name!r}: allowed: {TEN_PARTS.name}, {FOURTEEN_PARTS.name}")
    if angles.shape[-1:] != (len(anatomy.angles),):
        raise ValueError(f"angles of shape {angles.shape}: allowed: (..., {len(anatomy.angles)}) of {anatomy.name}")
    ball: Callable[[Anatomy, Floats, str, str], Floats] = _arcs if kind == "directions" else _joint_angles
    features = np.empty((*angles.shape[:-1], len(NAMES)))
    for side in ("right", "left"):
        for joint in ("shoulder", "hip"):
            first = NAMES.index(f"{side}_{joint}.x")
            features[..., first : first + 2] = ball(anatomy, angles, side, joint)
        elbow = angles[..., anatomy.index[f"{side}_elbow.x"]]
        features[..., NAMES.index(f"{side}_elbow.x")] = np.abs(elbow) if kind == "directions" else elbow
    return features


def _joint_angles(anatomy: Anatomy, angles: Floats, side: str, joint: str) -> Floats:
    """(..., 2) θ_x and θ_z of a ball joint in radians, each within half a turn of the middle of its range.

    Two pairs give the same direction; the pair on the side of the tracked angles is returned.
    """
    own = [angles[..., anatomy.index[f"{side}_{joint}.{axis}"]] for axis in "xz"]
    middle = np.array([anatomy.limits[anatomy.index[f"{side}_{joint}.{axis}"]].mean() for axis in "xz"])
    if anatomy is FOURTEEN_PARTS:
        direction = _direction(anatomy, angles, side, joint)
        x = np.arcsin(np.clip(direction[..., 2], -1.0, 1.0))
        z = np.arctan2(-direction[..., 0], direction[..., 1])
        beyond = np.cos(own[0]) < 0.0  # past the horizontal: the same direction with θ_z half a turn on
        own = [np.where(beyond, np.pi - x, x), np.where(beyond, z + np.pi, z)]
    values = np.stack(own, axis=-1)
    turns: Floats = values - 2.0 * np.pi * np.round((values - middle) / (2.0 * np.pi))
    return turns


def _arcs(anatomy: Anatomy, angles: Floats, side: str, joint: str) -> Floats:
    """(..., 2) arcs in radians from the middle of a limb's range to its direction: forwards, outwards.

    Logarithmic map of the sphere: the length is the angle between the two directions.
    """
    out = -1.0 if side == "right" else 1.0
    middle = unit(np.array(MIDDLES[joint]) * np.array([out, 1.0, 1.0]))
    front = unit(np.cross(middle, np.array([1.0, 0.0, 0.0])))
    sideways = out * np.cross(front, middle)
    direction = _direction(anatomy, angles, side, joint)
    arc = np.arccos(np.clip(direction @ middle, -1.0, 1.0))
    length = arc / np.maximum(np.sin(arc), 1e-6)
    arcs: Floats = np.stack([length * (direction @ front), length * (direction @ sideways)], axis=-1)
    return arcs


def _direction(anatomy: Anatomy, angles: Floats, side: str, joint: str) -> Floats:
    """(..., 3) direction of a limb in the torso frame: the second column of Rz Rx Ry."""
    x, z = (angles[..., anatomy.index[f"{side}_{joint}.{axis}"]] for axis in "xz")
    direction = np.stack([-np.sin(z) * np.cos(x), np.cos(z) * np.cos(x), np.sin(x)], axis=-1)
    if anatomy is TEN_PARTS:
        return direction
    waist = [anatomy.index[f"waist.{axis}"] for axis in "zxy"]
    chest_to_pelvis = euler_to_matrix("zxy", angles[..., waist])
    if joint == "shoulder":
        direction = np.einsum("...ij,...j->...i", chest_to_pelvis, direction)
    in_torso: Floats = np.einsum("...ji,...j->...i", _torso_to_pelvis(chest_to_pelvis), direction)
    return in_torso


def _torso_to_pelvis(chest_to_pelvis: Floats) -> Floats:
    """(..., 3, 3) Y from the hips to the mid-shoulder, X along the mean of hip and shoulder line."""
    y = unit(WAIST_SHARE * np.array([0.0, 1.0, 0.0]) + (1.0 - WAIST_SHARE) * chest_to_pelvis[..., 1])
    x = unit(perpendicular(np.array([1.0, 0.0, 0.0]) + chest_to_pelvis[..., 0], y))
    return np.stack([x, y, np.cross(x, y)], axis=-1)
