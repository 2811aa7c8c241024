"""Closest points of the body, and the printed distance D.  [Hybrid V-B, Eq. 30, 31]

The default D is that of `evidence.rays`; the option distance = "modulated" selects this one.
"""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.evidence.field import mean_square_outside
from zenocap.services.tracker.parameters import NORMAL_MODULATION, OUTSIDE_WEIGHT

CLOSEST_LENGTH = 6
ELLIPSE_STEPS = 3  # to the nearest point of an ellipse; error of the distance on a torso: 3 mm, 0.001, 0.004, 0
Point = tuple[float, float, float]  # in the frame of a part, metres


class Correspondence(NamedTuple):
    """Options of the point p' that corresponds to a scene point p.

    closest: it is on the part with the least |pp'|, else on the one with the least md |pp'|.
    flat: parts are cylinders with flat ends, else their ends are round.
    """

    closest: bool
    flat: bool


@leaf_kernel
def axis_length(model: BodyModel, part: int, flat: bool) -> float:
    """Length of a part's axis, metres: without the round cap of a free end, or with it where ends are flat."""
    if flat and model.free[part] > 0.0:
        return float(model.lengths[part] + 0.5 * (model.radii[part, 2] + model.radii[part, 3]))
    return float(model.lengths[part])


@leaf_kernel
def closest_point(
    model: BodyModel, frame: Floats, part: int, flat: bool, point: Floats, normal: Floats, found: Floats
) -> None:
    """Closest point p' of a part, whose frame is (3, 4), to a scene point p (3,) with normal n_p (3,).

    Writes found (6,): |pp'| in metres, md |pp'|, cos(n_p, n_p'), p' (3,) in the world.  flat: see `Correspondence`.  Exact
    for parts without taper that are round or have flat ends; on others p' is on the line from the axis to p.
    """
    dx, dy, dz = point[0] - frame[0, 3], point[1] - frame[1, 3], point[2] - frame[2, 3]
    x = -model.bases[part, 0] + frame[0, 0] * dx + frame[1, 0] * dy + frame[2, 0] * dz
    y = -model.bases[part, 1] + frame[0, 1] * dx + frame[1, 1] * dy + frame[2, 1] * dz
    z = -model.bases[part, 2] + frame[0, 2] * dx + frame[1, 2] * dy + frame[2, 2] * dz
    length = axis_length(model, part, flat)
    s = min(max(y, 0.0), length)
    share = s / length
    wide = model.radii[part, 0] + share * (model.radii[part, 2] - model.radii[part, 0])
    deep = model.radii[part, 1] + share * (model.radii[part, 3] - model.radii[part, 1])
    if flat:
        away, surface, outwards = _on_cylinder(x, y, z, wide, deep, length)
    else:
        away, surface, outwards = _on_round_part((x, y - s, z), (wide, 0.5 * (wide + deep), deep), s)
    cosine = 0.0
    for k in range(3):
        for row in range(3):
            cosine += normal[row] * frame[row, k] * outwards[k]
    for row in range(3):
        found[3 + row] = frame[row, 3]
        for k in range(3):
            found[3 + row] += frame[row, k] * (model.bases[part, k] + surface[k])
    # Paper (open): epsilon of md has no value; NORMAL_MODULATION.
    found[0], found[1], found[2] = away, (1.0 - NORMAL_MODULATION * cosine) * away, cosine


# Paper (replaced): [Hybrid II] has cylinders; a part ends in half an ellipsoid by default, in a plane with ends = "flat".
@leaf_kernel
def _on_round_part(offset: Point, sides: Point, s: float) -> tuple[float, Point, Point]:
    """|pp'| in metres, closest point and outward unit normal of a part with round ends.

    offset: of p from the point of the axis s metres from its start.  sides: half axes there.
    """
    size = squared = away = 0.0
    for k in range(3):
        size += (offset[k] / sides[k]) ** 2
        squared += (offset[k] / (sides[k] * sides[k])) ** 2
        away += offset[k] * offset[k]
    size, squared, away = np.sqrt(size) + 1e-9, np.sqrt(squared) + 1e-9, np.sqrt(away)
    (x, y, z), (a, b, c) = offset, sides
    outwards = (x / (a * a * squared), y / (b * b * squared), z / (c * c * squared))
    return np.abs(1.0 - 1.0 / size) * away, (x / size, y / size + s, z / size), outwards


@leaf_kernel
def _on_cylinder(x: float, y: float, z: float, wide: float, deep: float, length: float) -> tuple[float, Point, Point]:
    """The same of an elliptic cylinder with flat ends; on the rim, the normal points to p.  x, y, z: p from the start."""
    if np.abs(x) + np.abs(z) < 1e-9:  # on the axis, from which every side is as near
        x = 1e-9
    edge_x, edge_z = _on_ellipse(x, z, wide, deep)
    beside = np.sqrt((x - edge_x) ** 2 + (z - edge_z) ** 2)  # metres outside of the side; negative within
    if (x / wide) ** 2 + (z / deep) ** 2 < 1.0:
        beside = -beside
    end, sign = (0.0, -1.0) if y < 0.5 * length else (length, 1.0)
    beyond = sign * (y - end)
    on_side = beside > 0.0 or (beyond <= 0.0 and beside >= beyond)
    on_end = beyond > 0.0 or (beside <= 0.0 and not on_side)
    sx, sy, sz = edge_x if on_side else x, end if on_end else y, edge_z if on_side else z
    if not on_end:
        nx, ny, nz = edge_x / (wide * wide), 0.0, edge_z / (deep * deep)
    elif not on_side:
        nx, ny, nz = 0.0, sign, 0.0
    else:
        nx, ny, nz = x - sx, y - sy, z - sz
    scale = 1.0 / (np.sqrt(nx**2 + ny**2 + nz**2) + 1e-12)
    away = np.sqrt((x - sx) ** 2 + (y - sy) ** 2 + (z - sz) ** 2)
    return away, (sx, sy, sz), (nx * scale, ny * scale, nz * scale)


@leaf_kernel
def _on_ellipse(x: float, z: float, wide: float, deep: float) -> tuple[float, float]:
    """Nearest point of an ellipse about the origin with half axes along x and z; exact on a circle.

    The circle of curvature at the last point gives the next one.
    """
    at_x = at_z = np.sqrt(0.5)  # in the first quadrant, of the half axes
    for _ in range(1 if wide == deep else ELLIPSE_STEPS):
        middle_x = (wide * wide - deep * deep) * at_x**3 / wide
        middle_z = (deep * deep - wide * wide) * at_z**3 / deep
        radius = (wide * at_x - middle_x) ** 2 + (deep * at_z - middle_z) ** 2
        to_x, to_z = np.abs(x) - middle_x, np.abs(z) - middle_z
        scale = np.sqrt(radius / (to_x * to_x + to_z * to_z + 1e-18))
        at_x = min(max((to_x * scale + middle_x) / wide, 0.0), 1.0)
        at_z = min(max((to_z * scale + middle_z) / deep, 0.0), 1.0)
        size = np.sqrt(at_x * at_x + at_z * at_z) + 1e-12
        at_x, at_z = at_x / size, at_z / size
    return wide * np.copysign(at_x, x), deep * np.copysign(at_z, z)


@leaf_kernel
def part_capsules(model: BodyModel, frames: Floats, flat: bool, capsules: Floats) -> None:
    """Write for every part (p, 5) start and length of its axis, and a radius about that contains it; metres.

    flat: see `Correspondence`.
    """
    for part in range(frames.shape[0]):
        for row in range(3):
            capsules[part, row] = frames[part, row, 3]
            for k in range(3):
                capsules[part, row] += frames[part, row, k] * model.bases[part, k]
        capsules[part, 3] = axis_length(model, part, flat)
        capsules[part, 4] = 1e-9  # for rounding
        for k in range(4):
            capsules[part, 4] = max(capsules[part, 4], model.radii[part, k] + 1e-9)


@leaf_kernel
def scene_point(rays: Floats32, i: int, point: Floats, normal: Floats) -> None:
    """Write scene point (3,) and its normal (3,) of ray i."""
    # Paper (open): where on a viewing line the point is; the middle of the surviving interval.
    depth = 0.5 * (rays[9, i] + rays[10, i])
    for k in range(3):
        point[k] = rays[k, i] + depth * rays[3 + k, i]
        normal[k] = rays[6 + k, i]


@leaf_kernel
def corresponding_part(
    model: BodyModel, frames: Floats, capsules: Floats, by: Correspondence, likely: int,
    point: Floats, normal: Floats, found: Floats, best: Floats,
) -> int:  # fmt: skip
    """Part that corresponds to a scene point.

    Writes best (6,), see `closest_point`.  capsules: see `part_capsules`.  likely: any part; the closer it is, the faster.
    found: (6,) scratch.
    """
    # Paper (replaced): Eq. 31 has the closest part; by default the one with the least md |pp'| (`association`).
    part, column, factor = likely, 0 if by.closest else 1, 1.0 if by.closest else 1.0 - NORMAL_MODULATION
    closest_point(model, frames[likely], likely, by.flat, point, normal, best)
    for other in range(frames.shape[0]):
        if other == likely:
            continue
        along = 0.0
        for k in range(3):
            along += (point[k] - capsules[other, k]) * frames[other, k, 1]
        along = min(max(along, 0.0), capsules[other, 3])
        apart = 0.0
        for k in range(3):
            apart += (point[k] - capsules[other, k] - along * frames[other, k, 1]) ** 2
        if apart >= (best[column] / factor + capsules[other, 4]) ** 2:
            continue
        closest_point(model, frames[other], other, by.flat, point, normal, found)
        if found[column] < best[column]:
            part = other
            for k in range(CLOSEST_LENGTH):
                best[k] = found[k]
    return part


@kernel
def mean_modulated_square(model: BodyModel, frames: Floats, rays: Floats32, limit: float, by: Correspondence) -> float:
    """D, the mean of rho((md |pp'|)^2) over the scene in m^2, rho(y) = min(y, limit^2).  [Hybrid Eq. 30, 31]"""
    # Paper (open): the truncation of rho has no value; RESIDUAL_LIMIT_M.
    capsules = np.empty((frames.shape[0], 5))
    part_capsules(model, frames, by.flat, capsules)
    point, normal, found, best = np.empty(3), np.empty(3), np.empty(CLOSEST_LENGTH), np.empty(CLOSEST_LENGTH)
    total, part = 0.0, 0
    for i in range(rays.shape[1]):
        scene_point(rays, i, point, normal)
        part = corresponding_part(model, frames, capsules, by, part, point, normal, found, best)
        total += min(best[1], limit) ** 2
    return float(total / max(rays.shape[1], 1))


@kernel
def modulated_misfit(model: BodyModel, evidence: Evidence, limit: float, by: Correspondence, pose: RootedPose) -> float:
    """The printed D of a pose in m^2, plus the mean square distance of the body outside of the field's silhouettes."""
    frames = frames_of(model, pose)
    return float(
        mean_modulated_square(model, frames, evidence.rays, limit, by)
        + OUTSIDE_WEIGHT * mean_square_outside(model, frames, evidence.field, limit)
    )
