"""From joint centres to poses: what a motion file or a triangulation says, in the words of an anatomy.

Where joint centres leave a rotation open, the body decides: the head does not turn about itself, a bare hip and shoulder
line share the lean of the spine, and straight limbs turn as `common.body.twists` has it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.euler import angles_near, rotation
from common.body.twists import CLEAR, across, hinge_axes, swing, unit

SIDES = (("right", "R", -1.0), ("left", "L", 1.0))
NEEDED = tuple(f"{letter}{name}" for letter in "RL" for name in ("Hip", "Knee", "Ankle", "Shoulder", "Elbow", "Wrist"))
# Where the body is not given, shares of its average: the spine's bend between hip line and shoulder line, the head's
# joint between shoulder line and crown.
WAIST, THROAT = 0.35, 0.22
HANGING = np.diag([-1.0, -1.0, 1.0])  # half a turn about Z
DOWN = np.array([0.0, -1.0, 0.0])
TOES = 0.3  # weight of the foot's heading on the turn of a straight leg, against 1 of a knee bent by 15°
SOLE_DEG = (5.0, 45.0)  # ankle to ball of the foot, below the horizontal while standing
LOW_M = 0.015


@dataclass(frozen=True)
class _Limb:
    """A ball joint and the hinge after it.  bends: sign of a natural flexion.  towards: where the limb is when it turns
    about itself by nothing, in its parent's frame."""

    ball: str
    hinge: str
    markers: tuple[str, str, str]
    bends: float
    towards: Floats


def poses_from_centres(anatomy: Anatomy, centres: Mapping[str, Floats], bdp: Bdp | None = None) -> list[Pose]:
    """The n poses of an anatomy, ten-parts or fourteen-parts, whose parts point as the joint centres say.

    centres: by HALPE name, (n, 3) metres in the Y-up world; NaN is unknown and interpolated, at the ends held.  `Hip`,
    `Neck` (the middles) and `Head` (the crown) may be absent, and so may `RToe`, `LToe` (the balls of the feet) and
    `Waist` (the spine's bend); without them feet stand at 90° and the spine bends to the sides only.
    bdp: whose centres these are; without it they are a person's of average proportions.
    Angles are continuous; the flexion of hinges is within the anatomy's limits.  Raises ValueError for centres that are
    missing and for other anatomies.
    """
    known = filled(centres)
    torso, chest = ("torso", "torso") if "torso" in anatomy.parts else ("pelvis", "chest")
    if not {torso, chest, "head"} <= set(anatomy.parts):
        raise ValueError(f"anatomy {anatomy.name!r}: allowed: one with a torso, or with pelvis and chest, and a head")
    to_world = _spine(known, torso != chest, anatomy, bdp)
    angles = np.tile(anatomy.neutral, (len(known["Hip"]), 1))
    _set_root(anatomy, angles, to_world[torso])
    if torso != chest:
        _set_ball(anatomy, angles, "waist", np.swapaxes(to_world[torso], 1, 2) @ to_world[chest])
    if "Head" in known:
        _set_ball(anatomy, angles, "neck", _head(known, to_world[chest], anatomy, bdp))
    for side, letter, out in SIDES:
        arm = (f"{letter}Shoulder", f"{letter}Elbow", f"{letter}Wrist")
        leg = (f"{letter}Hip", f"{letter}Knee", f"{letter}Ankle")
        _set_limb(
            anatomy, angles, known, to_world[chest],
            _Limb(f"{side}_shoulder", f"{side}_elbow", arm, 1.0, np.array([0.5 * out, -0.6, 0.6])),
        )  # fmt: skip
        _set_limb(
            anatomy, angles, known, to_world[torso],
            _Limb(f"{side}_hip", f"{side}_knee", leg, -1.0, np.array([0.1 * out, -0.85, 0.5])),
        )  # fmt: skip
    positions = known["Hip"].copy()
    if bdp is not None and torso != chest:
        positions -= to_world[torso] @ _middle(anatomy, bdp, "hip")
    return [Pose(position, row) for position, row in zip(positions, angles, strict=True)]


def filled(centres: Mapping[str, Floats]) -> dict[str, Floats]:
    """The centres (n, 3) by name with every unknown one interpolated over the rows, and `Hip` and `Neck` where absent.

    Centres that are unknown in every row are left out.  Raises ValueError when needed ones are.
    """
    known = {name: _interpolated(points) for name, points in centres.items() if _whole(points).any()}
    missing = [name for name in NEEDED if name not in known]
    if missing:
        raise ValueError(f"joint centres {', '.join(missing)}: in no frame; there are: {', '.join(known) or 'none'}")
    known.setdefault("Hip", 0.5 * (known["RHip"] + known["LHip"]))
    known.setdefault("Neck", 0.5 * (known["RShoulder"] + known["LShoulder"]))
    return known


def _whole(points: Floats) -> NDArray[np.bool_]:
    whole: NDArray[np.bool_] = np.all(np.isfinite(points), axis=1)
    return whole


def _interpolated(points: Floats) -> Floats:
    there, rows = np.flatnonzero(_whole(points)), np.arange(len(points))
    return np.stack([np.interp(rows, there, points[there, column]) for column in range(3)], axis=1)


def _middle(anatomy: Anatomy, bdp: Bdp, joint: str) -> Floats:
    """(3,) between the right and the left joint, in their parent's frame."""
    middle: Floats = 0.5 * (bdp.offsets[anatomy.index[f"right_{joint}"]] + bdp.offsets[anatomy.index[f"left_{joint}"]])
    return middle


def _frame(x: Floats, y: Floats) -> Floats:
    """(n, 3, 3) rotations whose columns are the perpendicular unit axes x, y (n, 3) and x × y."""
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _spine(known: Mapping[str, Floats], bends: bool, anatomy: Anatomy, bdp: Bdp | None) -> dict[str, Floats]:
    """Rotations (n, 3, 3), part to world, of the torso, or of pelvis and chest."""
    hips, shoulders = known["LHip"] - known["RHip"], known["LShoulder"] - known["RShoulder"]
    trunk = known["Neck"] - known["Hip"]
    if not bends:
        y = unit(trunk)
        return {"torso": _frame(unit(across(unit(hips) + unit(shoulders), y)), y)}
    x = unit(hips)
    y = unit(across(known["Waist"] - known["Hip"] if "Waist" in known else trunk, x))
    if "Waist" in known:
        waist = known["Waist"]
    elif bdp is not None:
        waist = known["Hip"] + (bdp.offsets[anatomy.index["waist"]] - _middle(anatomy, bdp, "hip"))[1] * y
    else:
        waist = known["Hip"] + WAIST * np.linalg.norm(trunk, axis=1, keepdims=True) * y
    upper = unit(known["Neck"] - waist)
    return {"pelvis": _frame(x, y), "chest": _frame(unit(across(shoulders, upper)), upper)}


def _head(known: Mapping[str, Floats], chest: Floats, anatomy: Anatomy, bdp: Bdp | None) -> Floats:
    """(n, 3, 3) head to chest, turned as little as may be so that it points at the crown."""
    crown = np.einsum("nji,nj->ni", chest, known["Head"] - known["Neck"])
    head = anatomy.index["head"]
    axis = np.array([0.0, 1.0, 0.0])
    if bdp is None:
        joint = np.zeros_like(crown)
        if "neck_column" in anatomy.parts:
            joint[:, 1] = THROAT * np.linalg.norm(crown, axis=1)
    else:
        above = bdp.offsets[head] + (bdp.offsets[anatomy.index["neck_base"]] if "neck_base" in anatomy.index else 0.0)
        joint = np.broadcast_to(above - _middle(anatomy, bdp, "shoulder"), crown.shape)
        axis = axis * bdp.sizes[head, 0] + (bdp.bases[head] if bdp.bases is not None else 0.0)
    return swing(unit(axis), unit(crown - joint))


def _set_root(anatomy: Anatomy, angles: Floats, to_world: Floats) -> None:
    root, near = anatomy.joints[0], np.zeros((1, 3))
    for row in range(len(angles)):  # each near the one before: who turns round and round goes past a whole turn
        near = angles_near(root.axes, to_world[row : row + 1], near)
        angles[row, :3] = near


def _set_ball(anatomy: Anatomy, angles: Floats, name: str, to_parent: Floats) -> None:
    joint = anatomy.joints[anatomy.index[name]]
    first = anatomy.index[f"{name}.{joint.axes[0]}"]
    middle = np.array([0.5 * (low + high) for low, high in joint.limits])
    angles[:, first : first + 3] = angles_near(joint.axes, to_parent, np.broadcast_to(middle, (len(angles), 3)))


def _set_limb(anatomy: Anatomy, angles: Floats, known: Mapping[str, Floats], parent: Floats, limb: _Limb) -> None:
    start, middle, end = (known[name] for name in limb.markers)
    upper, lower = (np.einsum("nji,nj->ni", parent, unit(far - near)) for near, far in ((start, middle), (middle, end)))
    towards = unit(limb.towards)
    natural = np.einsum("nij,j->ni", swing(towards, upper) @ swing(DOWN, towards), HANGING[:, 0])
    seen = [(limb.bends * np.cross(upper, lower), CLEAR**-4, 4)]
    toe, foot = f"{limb.markers[0][0]}Toe", None
    if limb.ball.endswith("hip") and toe in known:
        foot = np.einsum("nji,nj->ni", parent, unit(known[toe] - end))
        seen.append((np.cross(upper, foot), TOES, 2))
    x = hinge_axes(upper, tuple(seen), natural)
    to_parent = _frame(x, upper)
    _set_ball(anatomy, angles, limb.ball, to_parent)
    bend = _flexion(to_parent, lower)
    _set_hinge(anatomy, angles, limb.hinge, bend)
    ankle = limb.hinge.replace("knee", "ankle")
    if foot is not None and ankle in anatomy.index:
        shank = to_parent @ rotation("x", angles[:, [anatomy.index[f"{limb.hinge}.x"]]])
        _set_hinge(anatomy, angles, ankle, _flexion(shank, foot) + _below(known, toe, end))


def _set_hinge(anatomy: Anatomy, angles: Floats, name: str, values: Floats) -> None:
    at = anatomy.index[f"{name}.x"]
    angles[:, at] = np.clip(values, *anatomy.limits[at])


def _flexion(to_parent: Floats, direction: Floats) -> Floats:
    """(n,) radians about X from a part's axis to a direction (n, 3) in its parent's frame."""
    y, z = (np.sum(to_parent[:, :, column] * direction, axis=1) for column in (1, 2))
    angles: Floats = np.arctan2(z, y)
    return angles


def _below(known: Mapping[str, Floats], toe: str, ankle: Floats) -> float:
    """How far the line from ankle to ball points below the foot's axis, radians.

    That is horizontal while the foot stands, which it does where both are low.
    """
    to_ball = unit(known[toe] - ankle)
    height = ankle[:, 1] + known[toe][:, 1]
    standing = height < np.quantile(height, 0.05) + LOW_M
    below = float(np.median(np.arcsin(np.clip(-to_ball[standing, 1], -1.0, 1.0))))
    return float(np.clip(below, *np.radians(SOLE_DEG)))
