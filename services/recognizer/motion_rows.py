"""Rows of a motion: ten angles, joints, trunk, height over the feet, way, heading.

Joint positions are those of a standard body, so that people of any size give equal rows; they need no measured body.
"""

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.services.recognizer import parameters as p
from zenocap.services.recognizer.features import DEFAULT, NAMES, Kind, features_of

JOINTS = (
    "right_elbow", "right_wrist", "left_elbow", "left_wrist", "right_knee", "right_ankle", "left_knee", "left_ankle",
    "head",
)  # fmt: skip
# Columns of a row.
ANGLES = slice(0, len(NAMES))  # as `features_of`
POINTS = slice(ANGLES.stop, ANGLES.stop + 3 * len(JOINTS))  # of JOINTS from the hips, body heights: left, up, front
TRUNK_UP = slice(POINTS.stop, POINTS.stop + 3)  # direction from the hips to the shoulders: left, up, front
HEIGHT = TRUNK_UP.stop  # of the hips over the lower ankle, body heights
WAY = slice(HEIGHT + 1, HEIGHT + 3)  # x and z of the navel in the world, metres
HEADING = slice(WAY.stop, WAY.stop + 2)  # x and z of the pelvis's front in the world, of length 1
WIDTH = HEADING.stop


def rows_of(anatomy: Anatomy, positions: Floats, angles: Floats, kind: Kind = DEFAULT) -> Floats:
    """Rows (T, WIDTH) of poses of `ten-parts` or `fourteen-parts`.

    positions: (T, 3) navel in the world, metres, Y up.  angles: (T, angles) radians in the order of `Anatomy.angles`.
    kind: of the ten angles.  NaN in a pose gives NaN.  Raises ValueError for another anatomy or shape.
    """
    rows = np.full((len(angles), WIDTH), np.nan)
    rows[:, ANGLES] = features_of(anatomy, angles, kind)
    root = _rotation(anatomy, angles, "navel")
    left = root[..., 0] * np.array([1.0, 0.0, 1.0])
    left /= np.maximum(np.linalg.norm(left, axis=1, keepdims=True), 1e-9)
    up = np.broadcast_to(np.array([0.0, 1.0, 0.0]), left.shape)
    front = np.cross(left, up)
    to_heading = np.stack([left, up, front], axis=1)
    shoulders, points = _standard_body(anatomy, angles, root)
    points = np.einsum("tij,tkj->tki", to_heading, points)
    rows[:, POINTS] = points.reshape(len(angles), -1)
    rows[:, TRUNK_UP] = np.einsum("tij,tj->ti", to_heading, shoulders / np.linalg.norm(shoulders, axis=1, keepdims=True))
    ankles = points[:, [JOINTS.index("right_ankle"), JOINTS.index("left_ankle")], 1]
    rows[:, HEIGHT] = -ankles.min(axis=1)
    rows[:, WAY] = positions[:, [0, 2]]
    rows[:, HEADING] = front[:, [0, 2]]
    return rows


def _standard_body(anatomy: Anatomy, angles: Floats, root: Floats) -> tuple[Floats, Floats]:
    """(T, 3) middle of the shoulders and (T, 9, 3) JOINTS from the middle of the hips, in body heights, world axes."""
    chest, shoulders = root, p.TRUNK * root[..., 1]
    if anatomy is FOURTEEN_PARTS:
        chest = root @ _rotation(anatomy, angles, "waist")
        shoulders = p.WAIST_SHARE * p.TRUNK * root[..., 1] + (1.0 - p.WAIST_SHARE) * p.TRUNK * chest[..., 1]
    points = []
    for joint, below, half, base, origin, lengths in (
        ("shoulder", "elbow", p.SHOULDER_HALF, chest, shoulders, (p.UPPER_ARM, p.FOREARM)),
        ("hip", "knee", p.HIP_HALF, root, np.zeros(3), (p.THIGH, p.SHANK)),
    ):
        for side, sign in (("right", -1.0), ("left", 1.0)):
            upper = base @ _rotation(anatomy, angles, f"{side}_{joint}")
            lower = upper @ _rotation(anatomy, angles, f"{side}_{below}")
            middle = origin + sign * half * base[..., 0] + lengths[0] * upper[..., 1]
            points += [middle, middle + lengths[1] * lower[..., 1]]
    head = chest @ _rotation(anatomy, angles, "neck")
    return shoulders, np.stack([*points, shoulders + p.HEAD * head[..., 1]], axis=1)


def _rotation(anatomy: Anatomy, angles: Floats, name: str) -> Floats:
    """(T, 3, 3) rotation of a joint's part against its parent."""
    joint = next(joint for joint in anatomy.joints if joint.name == name)
    return euler_to_matrix(joint.axes, angles[:, [anatomy.index[f"{name}.{axis}"] for axis in joint.axes]])
