"""Closest points of the body, and the printed distance D.  [Hybrid V-B, Eq. 30, 31]

The default D is that of `evidence.rays`; the option distance = "modulated" selects this one.
"""

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.jit import kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.evidence.field import mean_square_outside
from zenocap.services.tracker.parameters import NORMAL_MODULATION, OUTSIDE_WEIGHT

CLOSEST_LENGTH = 6


@kernel
def closest_point(model: BodyModel, frame: Floats, part: int, point: Floats, normal: Floats, found: Floats) -> None:
    """Closest point p' of a part, whose frame is (3, 4), to a scene point p (3,) with normal n_p (3,).

    Writes found (6,): |pp'| in metres, md |pp'|, cos(n_p, n_p'), p' (3,) in the world.  Exact for round parts without
    taper; on others p' is where the line from the axis to p leaves the surface.
    """
    local, sides = np.empty(3), np.empty(3)
    for k in range(3):
        local[k] = -model.bases[part, k]
        for row in range(3):
            local[k] += frame[row, k] * (point[row] - frame[row, 3])
    length = model.lengths[part]
    s = min(max(local[1], 0.0), length)
    share = s / length
    sides[0] = model.radii[part, 0] + share * (model.radii[part, 2] - model.radii[part, 0])
    sides[2] = model.radii[part, 1] + share * (model.radii[part, 3] - model.radii[part, 1])
    sides[1] = 0.5 * (sides[0] + sides[2])
    local[1] -= s
    size = squared = cosine = away = 0.0
    for k in range(3):
        size += (local[k] / sides[k]) ** 2
        squared += (local[k] / (sides[k] * sides[k])) ** 2
        away += local[k] * local[k]
    size, squared, away = np.sqrt(size) + 1e-9, np.sqrt(squared) + 1e-9, np.sqrt(away)
    for k in range(3):
        outwards = local[k] / (sides[k] * sides[k] * squared)
        for row in range(3):
            cosine += normal[row] * frame[row, k] * outwards
    for row in range(3):
        found[3 + row] = frame[row, 3]
        for k in range(3):
            found[3 + row] += frame[row, k] * (model.bases[part, k] + local[k] / size)
        found[3 + row] += frame[row, 1] * s
    found[0] = np.abs(1.0 - 1.0 / size) * away
    # Paper (open): epsilon of md has no value; NORMAL_MODULATION.
    found[1] = (1.0 - NORMAL_MODULATION * cosine) * found[0]
    found[2] = cosine


@kernel
def part_spheres(model: BodyModel, frames: Floats, centres: Floats, reach: Floats) -> None:
    """Write for every part the middle of its axis (p, 3), and a radius (p,) about it that contains the part; metres."""
    for part in range(frames.shape[0]):
        half, widest = 0.5 * model.lengths[part], 0.0
        for k in range(4):
            widest = max(widest, model.radii[part, k])
        # The ends are spheres or ellipsoids about the ends of the axis.
        reach[part] = half + widest
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
    model: BodyModel, frames: Floats, centres: Floats, reach: Floats, closest: bool, likely: int,
    point: Floats, normal: Floats, found: Floats, best: Floats,
) -> int:  # fmt: skip
    """Part that corresponds to a scene point: the one with the least |pp'|, or with closest = False the least md |pp'|.

    Writes best (6,), see `closest_point`.  centres, reach: see `part_spheres`.  likely: any part; the closer it is, the
    faster.  found: (6,) scratch.
    """
    part, column, factor = likely, 0 if closest else 1, 1.0 if closest else 1.0 - NORMAL_MODULATION
    closest_point(model, frames[likely], likely, point, normal, best)
    for other in range(frames.shape[0]):
        if other == likely:
            continue
        apart = 0.0
        for k in range(3):
            apart += (point[k] - centres[other, k]) ** 2
        if factor * (np.sqrt(apart) - reach[other]) >= best[column]:
            continue
        closest_point(model, frames[other], other, point, normal, found)
        if found[column] < best[column]:
            part = other
            for k in range(CLOSEST_LENGTH):
                best[k] = found[k]
    return part


@kernel
def mean_modulated_square(model: BodyModel, frames: Floats, rays: Floats32, limit: float, closest: bool) -> float:
    """D, the mean of rho((md |pp'|)^2) over the scene in m^2, rho(y) = min(y, limit^2).  [Hybrid Eq. 30, 31]"""
    # Paper (open): the truncation of rho has no value; RESIDUAL_LIMIT_M.
    centres, reach = np.empty((frames.shape[0], 3)), np.empty(frames.shape[0])
    part_spheres(model, frames, centres, reach)
    point, normal, found, best = np.empty(3), np.empty(3), np.empty(CLOSEST_LENGTH), np.empty(CLOSEST_LENGTH)
    total, part = 0.0, 0
    for i in range(rays.shape[1]):
        scene_point(rays, i, point, normal)
        part = corresponding_part(model, frames, centres, reach, closest, part, point, normal, found, best)
        total += min(best[1], limit) ** 2
    return float(total / max(rays.shape[1], 1))


@kernel
def modulated_misfit(model: BodyModel, evidence: Evidence, limit: float, closest: bool, pose: RootedPose) -> float:
    """The printed D of a pose in m^2, plus the mean square distance of the body outside of the field's silhouettes."""
    frames = frames_of(model, pose)
    return float(
        mean_modulated_square(model, frames, evidence.rays, limit, closest)
        + OUTSIDE_WEIGHT * mean_square_outside(model, frames, evidence.field, limit)
    )
