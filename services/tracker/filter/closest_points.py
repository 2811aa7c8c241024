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


@kernel
def closest_point(
    model: BodyModel, frame: Floats, part: int, flat: bool, point: Floats, normal: Floats, found: Floats
) -> None:
    """Closest point p' of a part, whose frame is (3, 4), to a scene point p (3,) with normal n_p (3,).

    Writes found (6,): |pp'| in metres, md |pp'|, cos(n_p, n_p'), p' (3,) in the world.  flat: see `Correspondence`.  Exact
    for round parts without taper; on others p' is where the line from the axis to p leaves the surface.
    """
    local, sides, surface, outwards = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        local[k] = -model.bases[part, k]
        for row in range(3):
            local[k] += frame[row, k] * (point[row] - frame[row, 3])
    length = axis_length(model, part, flat)
    s = min(max(local[1], 0.0), length)
    share = s / length
    sides[0] = model.radii[part, 0] + share * (model.radii[part, 2] - model.radii[part, 0])
    sides[2] = model.radii[part, 1] + share * (model.radii[part, 3] - model.radii[part, 1])
    sides[1] = 0.5 * (sides[0] + sides[2])
    if flat:
        found[0] = _on_cylinder(local, sides, length, surface, outwards)
    else:
        found[0] = _on_round_part(local, sides, s, surface, outwards)
    cosine = 0.0
    for k in range(3):
        for row in range(3):
            cosine += normal[row] * frame[row, k] * outwards[k]
    for row in range(3):
        found[3 + row] = frame[row, 3]
        for k in range(3):
            found[3 + row] += frame[row, k] * (model.bases[part, k] + surface[k])
    # Paper (open): epsilon of md has no value; NORMAL_MODULATION.
    found[1] = (1.0 - NORMAL_MODULATION * cosine) * found[0]
    found[2] = cosine


# Paper (replaced): [Hybrid II] has cylinders; a part ends in half an ellipsoid by default, in a plane with ends = "flat".
@leaf_kernel
def _on_round_part(local: Floats, sides: Floats, s: float, surface: Floats, outwards: Floats) -> float:
    """Write closest point and outward unit normal (3,) of a part with round ends; |pp'| in metres.

    local: (3,) from the start of the axis.  sides: (3,) half axes there, s metres along it.
    """
    size = squared = away = 0.0
    for k in range(3):
        offset = local[k] - s if k == 1 else local[k]
        size += (offset / sides[k]) ** 2
        squared += (offset / (sides[k] * sides[k])) ** 2
        away += offset * offset
    size, squared, away = np.sqrt(size) + 1e-9, np.sqrt(squared) + 1e-9, np.sqrt(away)
    for k in range(3):
        offset = local[k] - s if k == 1 else local[k]
        outwards[k] = offset / (sides[k] * sides[k] * squared)
        surface[k] = offset / size
    surface[1] += s
    return float(np.abs(1.0 - 1.0 / size) * away)


@leaf_kernel
def _on_cylinder(local: Floats, sides: Floats, length: float, surface: Floats, outwards: Floats) -> float:
    """The same of an elliptic cylinder with flat ends; on the rim, the normal points to p.  local: changed on the axis."""
    if np.abs(local[0]) + np.abs(local[2]) < 1e-9:  # on the axis, from which every side is as near
        local[0] = 1e-9
    size = np.sqrt((local[0] / sides[0]) ** 2 + (local[2] / sides[2]) ** 2)
    beside = np.sqrt(local[0] ** 2 + local[2] ** 2) * (1.0 - 1.0 / size)  # metres outside of the side; negative within
    end, sign = (0.0, -1.0) if local[1] < 0.5 * length else (length, 1.0)
    beyond = sign * (local[1] - end)
    on_side = beside > 0.0 or (beyond <= 0.0 and beside >= beyond)
    on_end = beyond > 0.0 or (beside <= 0.0 and not on_side)
    for k in range(3):
        surface[k] = local[k] / size if on_side and k != 1 else local[k]
        outwards[k] = local[k] / (sides[k] * sides[k]) if k != 1 else 0.0
    if on_end:
        surface[1] = end
    if on_end and not on_side:
        outwards[0], outwards[1], outwards[2] = 0.0, sign, 0.0
    elif on_end:
        for k in range(3):
            outwards[k] = local[k] - surface[k]
    scale = 1.0 / (np.sqrt(outwards[0] ** 2 + outwards[1] ** 2 + outwards[2] ** 2) + 1e-12)
    away = 0.0
    for k in range(3):
        outwards[k] *= scale
        away += (local[k] - surface[k]) ** 2
    return float(np.sqrt(away))


@kernel
def part_spheres(model: BodyModel, frames: Floats, flat: bool, centres: Floats, reach: Floats) -> None:
    """Write for every part the middle of its axis (p, 3), and a radius (p,) about it that contains the part; metres.

    flat: see `Correspondence`.
    """
    for part in range(frames.shape[0]):
        half, widest = 0.5 * axis_length(model, part, flat), 0.0
        for k in range(4):
            widest = max(widest, model.radii[part, k])
        # Round ends are spheres or ellipsoids about the ends of the axis.
        reach[part] = np.sqrt(half * half + widest * widest) if flat else half + widest
        for row in range(3):
            centres[part, row] = frames[part, row, 3] + frames[part, row, 1] * half
            for k in range(3):
                centres[part, row] += frames[part, row, k] * model.bases[part, k]


@kernel
def scene_point(rays: Floats32, i: int, point: Floats, normal: Floats) -> None:
    """Write scene point (3,) and its normal (3,) of ray i."""
    # Paper (open): where on a viewing line the point is; the middle of the surviving interval.
    depth = 0.5 * (rays[9, i] + rays[10, i])
    for k in range(3):
        point[k] = rays[k, i] + depth * rays[3 + k, i]
        normal[k] = rays[6 + k, i]


@kernel
def corresponding_part(
    model: BodyModel, frames: Floats, centres: Floats, reach: Floats, by: Correspondence, likely: int,
    point: Floats, normal: Floats, found: Floats, best: Floats,
) -> int:  # fmt: skip
    """Part that corresponds to a scene point.

    Writes best (6,), see `closest_point`.  centres, reach: see `part_spheres`.  likely: any part; the closer it is, the
    faster.  found: (6,) scratch.
    """
    part, column, factor = likely, 0 if by.closest else 1, 1.0 if by.closest else 1.0 - NORMAL_MODULATION
    closest_point(model, frames[likely], likely, by.flat, point, normal, best)
    for other in range(frames.shape[0]):
        if other == likely:
            continue
        apart = 0.0
        for k in range(3):
            apart += (point[k] - centres[other, k]) ** 2
        if factor * (np.sqrt(apart) - reach[other]) >= best[column]:
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
    centres, reach = np.empty((frames.shape[0], 3)), np.empty(frames.shape[0])
    part_spheres(model, frames, by.flat, centres, reach)
    point, normal, found, best = np.empty(3), np.empty(3), np.empty(CLOSEST_LENGTH), np.empty(CLOSEST_LENGTH)
    total, part = 0.0, 0
    for i in range(rays.shape[1]):
        scene_point(rays, i, point, normal)
        part = corresponding_part(model, frames, centres, reach, by, part, point, normal, found, best)
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
