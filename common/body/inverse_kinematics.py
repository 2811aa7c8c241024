"""Inverse kinematics: poses of an anatomy from joint centres.

Rotations that joint centres leave open are chosen.  The head does not twist.  Hip and shoulder line share the lean of
the spine.  The axial rotation of straight limbs is interpolated from frame to frame (`hinge_axes`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.rotations import TINY, euler_to_matrix, matrix_to_euler, perpendicular, shortest_rotation, unit

SIDES = (("right", "R", -1.0), ("left", "L", 1.0))
NEEDED = tuple(f"{letter}{name}" for letter in "RL" for name in ("Hip", "Knee", "Ankle", "Shoulder", "Elbow", "Wrist"))
HANGING = np.diag([-1.0, -1.0, 1.0])  # half a turn about Z: a limb hanging straight down
DOWN = np.array([0.0, -1.0, 0.0])

# All values below are chosen by hand.
WAIST = 0.35  # spine's bend between hip line (0) and shoulder line (1), of an average person; used without a body
THROAT = 0.22  # joint of the head between shoulder line (0) and crown (1), of an average person; used without a body
CLEAR = np.sin(np.radians(15.0))  # sine of the flexion at which the hinge's plane has weight 1 in `hinge_axes`
NEIGHBOURS = 0.3  # weight of equal axial rotation in consecutive frames
NATURAL = 2e-3  # weight of the limb's natural axis: decides only where no other measurement does
TOES = 0.3  # weight of the foot's heading on the axial rotation of a straight leg
SOLE_DEG = (5.0, 45.0)  # allowed angle of ankle to ball of the foot below the horizontal while standing
STANDING_QUANTILE = 0.05  # of the sum of the heights of ankle and ball of the foot, within which the foot stands
STANDING_M = 0.015  # and this much above it


@dataclass(frozen=True)
class _Limb:
    """A ball joint and the hinge after it.

    markers: HALPE names of ball joint, hinge and end.  flexion: sign of a natural flexion.
    middle: (3,) direction of the limb, in its parent's frame, at which its natural axial rotation is zero.
    """

    ball: str
    hinge: str
    markers: tuple[str, str, str]
    flexion: float
    middle: Floats


def poses_from_centres(anatomy: Anatomy, centres: Mapping[str, Floats], bdp: Bdp | None = None) -> list[Pose]:
    """Return the n poses of an anatomy (ten-parts or fourteen-parts) whose parts point along the joint centres.

    centres: by HALPE name, (n, 3) metres in the Y-up world; NaN is unknown: interpolated, and held at the ends.
    Optional: `Hip`, `Neck` (the middles), `Head` (the crown), `RToe`, `LToe` (balls of the feet) and `Waist` (the
    spine's bend).  Without the last three, feet are at 90° and the spine bends sideways only.
    bdp: the person's body; default: average proportions.
    Angles are continuous over the rows; hinges are within the anatomy's limits.  Raises ValueError for missing centres
    and for other anatomies.
    """
    known = interpolated_centres(centres)
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


def interpolated_centres(centres: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the centres (n, 3) by name, unknown rows interpolated, `Hip` and `Neck` added where absent.

    Centres that are unknown in every row are left out; ValueError if they are among NEEDED.
    """
    known = {name: interpolated(points) for name, points in centres.items() if _known(points).any()}
    missing = [name for name in NEEDED if name not in known]
    if missing:
        raise ValueError(f"joint centres {', '.join(missing)}: in no frame; there are: {', '.join(known) or 'none'}")
    known.setdefault("Hip", 0.5 * (known["RHip"] + known["LHip"]))
    known.setdefault("Neck", 0.5 * (known["RShoulder"] + known["LShoulder"]))
    return known


def _known(points: Floats) -> Bools:
    """(n,) whether all coordinates of a row are finite."""
    known: Bools = np.all(np.isfinite(points), axis=1)
    return known


def interpolated(points: Floats) -> Floats:
    """Points (n, 3) with rows that are not finite interpolated; at the ends the nearest row is repeated."""
    known, rows = np.flatnonzero(_known(points)), np.arange(len(points))
    return np.stack([np.interp(rows, known, points[known, column]) for column in range(3)], axis=1)


def _middle(anatomy: Anatomy, bdp: Bdp, joint: str) -> Floats:
    """(3,) midpoint of the right and the left joint in their parent's frame, metres."""
    middle: Floats = 0.5 * (bdp.offsets[anatomy.index[f"right_{joint}"]] + bdp.offsets[anatomy.index[f"left_{joint}"]])
    return middle


def _frame(x: Floats, y: Floats) -> Floats:
    """Rotations (n, 3, 3) with the perpendicular unit axes x, y (n, 3) and x × y as columns."""
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _spine(known: Mapping[str, Floats], two_parts: bool, anatomy: Anatomy, bdp: Bdp | None) -> dict[str, Floats]:
    """Rotations (n, 3, 3), part to world, of the torso, or with `two_parts` of pelvis and chest."""
    hips, shoulders = known["LHip"] - known["RHip"], known["LShoulder"] - known["RShoulder"]
    trunk = known["Neck"] - known["Hip"]
    if not two_parts:
        y = unit(trunk)
        return {"torso": _frame(unit(perpendicular(unit(hips) + unit(shoulders), y)), y)}
    x = unit(hips)
    y = unit(perpendicular(known["Waist"] - known["Hip"] if "Waist" in known else trunk, x))
    if "Waist" in known:
        waist = known["Waist"]
    elif bdp is not None:
        waist = known["Hip"] + (bdp.offsets[anatomy.index["waist"]] - _middle(anatomy, bdp, "hip"))[1] * y
    else:
        waist = known["Hip"] + WAIST * np.linalg.norm(trunk, axis=1, keepdims=True) * y
    upper = unit(known["Neck"] - waist)
    return {"pelvis": _frame(x, y), "chest": _frame(unit(perpendicular(shoulders, upper)), upper)}


def _head(known: Mapping[str, Floats], chest: Floats, anatomy: Anatomy, bdp: Bdp | None) -> Floats:
    """Rotations (n, 3, 3), head to chest, by the smallest angle that points the head at the crown."""
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
    return shortest_rotation(unit(axis), unit(crown - joint))


def _set_root(anatomy: Anatomy, angles: Floats, to_world: Floats) -> None:
    root, near = anatomy.joints[0], np.zeros((1, 3))
    for row in range(len(angles)):  # each near the previous one, so that yaw grows past a full turn
        near = matrix_to_euler(root.axes, to_world[row : row + 1], near)
        angles[row, :3] = near


def _set_ball(anatomy: Anatomy, angles: Floats, name: str, to_parent: Floats) -> None:
    joint = anatomy.joints[anatomy.index[name]]
    first = anatomy.index[f"{name}.{joint.axes[0]}"]
    middle = np.array([0.5 * (low + high) for low, high in joint.limits])
    angles[:, first : first + 3] = matrix_to_euler(joint.axes, to_parent, np.broadcast_to(middle, (len(angles), 3)))


def _set_limb(anatomy: Anatomy, angles: Floats, known: Mapping[str, Floats], parent: Floats, limb: _Limb) -> None:
    start, middle, end = (known[name] for name in limb.markers)
    upper, lower = (np.einsum("nji,nj->ni", parent, unit(far - near)) for near, far in ((start, middle), (middle, end)))
    zero = unit(limb.middle)
    natural = np.einsum("nij,j->ni", shortest_rotation(zero, upper) @ shortest_rotation(DOWN, zero), HANGING[:, 0])
    measured = [(limb.flexion * np.cross(upper, lower), CLEAR**-4, 4)]
    toe, foot = f"{limb.markers[0][0]}Toe", None
    if limb.ball.endswith("hip") and toe in known:
        foot = np.einsum("nji,nj->ni", parent, unit(known[toe] - end))
        measured.append((np.cross(upper, foot), TOES, 2))
    x = hinge_axes(upper, tuple(measured), natural)
    to_parent = _frame(x, upper)
    _set_ball(anatomy, angles, limb.ball, to_parent)
    bend = _flexion(to_parent, lower)
    _set_hinge(anatomy, angles, limb.hinge, bend)
    ankle = limb.hinge.replace("knee", "ankle")
    if foot is not None and ankle in anatomy.index:
        shank = to_parent @ euler_to_matrix("x", angles[:, [anatomy.index[f"{limb.hinge}.x"]]])
        _set_hinge(anatomy, angles, ankle, _flexion(shank, foot) + _sole_angle(known, toe, end))


def _set_hinge(anatomy: Anatomy, angles: Floats, name: str, values: Floats) -> None:
    at = anatomy.index[f"{name}.x"]
    angles[:, at] = np.clip(values, *anatomy.limits[at])


def _flexion(to_parent: Floats, direction: Floats) -> Floats:
    """Angle (n,) about X from a part's axis to `direction` (n, 3) in its parent's frame, radians."""
    y, z = (np.sum(to_parent[:, :, column] * direction, axis=1) for column in (1, 2))
    angles: Floats = np.arctan2(z, y)
    return angles


def _sole_angle(known: Mapping[str, Floats], toe: str, ankle: Floats) -> float:
    """Angle of the line from ankle to ball of the foot below the foot's axis, radians.

    The foot's axis is horizontal while the foot stands: where the sum of both heights is near its minimum.
    """
    to_ball = unit(known[toe] - ankle)
    height = ankle[:, 1] + known[toe][:, 1]
    standing = height < np.quantile(height, STANDING_QUANTILE) + STANDING_M
    below = float(np.median(np.arcsin(np.clip(-to_ball[standing, 1], -1.0, 1.0))))
    return float(np.clip(below, *np.radians(SOLE_DEG)))


def hinge_axes(direction: Floats, measured: tuple[tuple[Floats, float, int], ...], natural: Floats) -> Floats:
    """Unit hinge axes (n, 3) perpendicular to a limb's unit directions (n, 3), smooth over the rows.

    measured: measurements of the axis: vectors (n, 3) along it whose length, up to 1, is their reliability; the weight
    at length 1; the power of the length in the weight.  natural: (n, 3) axis in absence of measurements.

    With the axes as complex numbers c (angle about the direction), minimizes the sum of w |c_t - measured_t|^2
    + NATURAL |c_t - natural_t|^2 + NEIGHBOURS |c_t+1 - c_t|^2.  Consecutive rows are compared after the shortest rotation
    between their directions.
    """
    first = unit(perpendicular(natural, direction))
    second = np.cross(direction, first)
    wanted = np.full(len(direction), NATURAL, dtype=np.complex128)
    diagonal = np.full(len(direction), NATURAL)
    for vectors, weight, power in measured:
        found = np.sum(vectors * first, axis=-1) + 1j * np.sum(vectors * second, axis=-1)
        sure = weight * np.abs(found) ** power
        wanted += sure * found / np.maximum(np.abs(found), TINY)
        diagonal += sure
    bands = np.zeros((min(2, len(direction)), len(direction)), dtype=np.complex128)
    if len(direction) > 1:
        carried = np.einsum("nij,nj->ni", shortest_rotation(direction[:-1], direction[1:]), first[:-1])
        turn = np.sum(carried * first[1:], axis=-1) + 1j * np.sum(carried * second[1:], axis=-1)
        bands[0, 1:] = -NEIGHBOURS * np.conj(turn)
        diagonal[1:] += NEIGHBOURS
        diagonal[:-1] += NEIGHBOURS
    bands[-1] = diagonal
    turned = solveh_banded(bands, wanted)
    axes: Floats = unit(first * turned.real[:, None] + second * turned.imag[:, None])
    return axes
