"""A pose as the recogniser's feature vector: ten numbers, two for each upper limb, one for each elbow.  [Two-view 5.1]

Two kinds.  `joint-angles` is the paper's: θ_x and θ_z of shoulders and hips and θ_x of the elbows, as the tracker has
them.  They are singular where an arm points to the front and have two values for one place of an arm that is bent
(θ_y = ±90° with elbows either way).  `directions` is the default: where upper arms and legs point, as arcs on the sphere
around the middle of their range, and how far the elbows are bent.  Both are seen from the torso, not from the world.
"""

from collections.abc import Callable, Mapping
from typing import Literal, get_args

import numpy as np

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy, Floats
from common.body.euler import rotation
from common.body.twists import across, unit

Kind = Literal["directions", "joint-angles"]
KINDS: tuple[Kind, ...] = get_args(Kind)
DEFAULT: Kind = "directions"

NAMES = (
    "right_shoulder.x",
    "right_shoulder.z",
    "left_shoulder.x",
    "left_shoulder.z",
    "right_elbow.x",
    "left_elbow.x",
    "right_hip.x",
    "right_hip.z",
    "left_hip.x",
    "left_hip.z",
)
# The middle of what a limb reaches, in the torso's frame: (to the person's own side, up, to the front).
MIDDLES: Mapping[str, tuple[float, float, float]] = {"shoulder": (0.5, -0.6, 0.6), "hip": (0.1, -0.85, 0.5)}
WAIST_SHARE = 0.35  # of the spine's bend between hip line and shoulder line, as `common.body.from_centres` has it


def features_of(anatomy: Anatomy, angles: Floats, kind: Kind = DEFAULT) -> Floats:
    """(..., 10) radians in the order of NAMES, of poses of `ten-parts` or `fourteen-parts`.

    angles: (..., angles) radians, ordered by `Anatomy.angles`; NaN in, NaN out.  Raises ValueError for another anatomy
    and another shape.
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
    """(..., 2) θ_x and θ_z of a ball joint, each within half a turn of the middle of its range.

    Of two pairs for one direction, that on the side on which the anatomy's own angles are.
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
    """(..., 2) arcs in radians from the middle of a limb's range to where it points: to the front, to its own side.

    The logarithm on the sphere: its length is the angle between the two, whichever way.
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
    """(..., 3) where a limb points, in the torso's frame: the second column of Rz Rx Ry."""
    x, z = (angles[..., anatomy.index[f"{side}_{joint}.{axis}"]] for axis in "xz")
    direction = np.stack([-np.sin(z) * np.cos(x), np.cos(z) * np.cos(x), np.sin(x)], axis=-1)
    if anatomy is TEN_PARTS:
        return direction
    waist = [anatomy.index[f"waist.{axis}"] for axis in "zxy"]
    chest_to_pelvis = rotation("zxy", angles[..., waist])
    if joint == "shoulder":
        direction = np.einsum("...ij,...j->...i", chest_to_pelvis, direction)
    in_torso: Floats = np.einsum("...ji,...j->...i", _torso_to_pelvis(chest_to_pelvis), direction)
    return in_torso


def _torso_to_pelvis(chest_to_pelvis: Floats) -> Floats:
    """(..., 3, 3): from the hips to the middle of the shoulders, and across as the mean of hip and shoulder line."""
    y = unit(WAIST_SHARE * np.array([0.0, 1.0, 0.0]) + (1.0 - WAIST_SHARE) * chest_to_pelvis[..., 1])
    x = unit(across(np.array([1.0, 0.0, 0.0]) + chest_to_pelvis[..., 0], y))
    return np.stack([x, y, np.cross(x, y)], axis=-1)
