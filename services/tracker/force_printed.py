"""Refinement of a pose by simulated force and moment, as printed.  [Hybrid V-B, Eq. 29-41]

Every scene point (the middle of its surviving interval) is assigned to the closest part, distances modulated by
md = 1 - epsilon cos; its force is rho(mF |pp'|), rho a truncated quadratic; moments are summed over a part's group and
added to the angles of its joint.  `refine_by_force` is the corrected form.

Where the print cannot work, the least change:
- Eq. 32's direction p p' pushes the model away from the scene.  It is P'P here, as Fig. 2 has it.
- Eq. 33's F x L then turns away too (with the printed direction the two errors cancel, for turns alone): it is L x F.
- Eq. 36 and 37 print x twice: the second component is y.
- Eq. 34 and 36 have rho where 38 has lambda, and 35 and 37 lambda where 39 and 40 have rho; the names of the latter are
  taken.  No value is given for them: LAMBDA and RHO, over the number of points in the group, are small enough to converge.
- In which frame a moment is added to angles is not said: in that of the part, and of a hinge the component about its axis.
  The angles of ball joints are rotation vectors here, and the root has none: it is turned by its moment.
- A cosine below zero points against the surface: such a point has no force, for the square of it would have one.
"""

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from common.body.rotation_vectors import rotation_of
from services.tracker.closest import Singles
from services.tracker.model import Model, place
from services.tracker.refine import Weights

EPSILON = 0.5  # of md
TRUNCATED_M = 0.10  # where rho stays
LAMBDA = 8.0  # 1 / m: of the mean force on a group, m^2
RHO = 60.0  # rad / m^3: of the mean moment on a group
TOUCHED = 6


@njit(cache=True, error_model="numpy")
def closest(model: Model, frame: Floats, part: int, point: Floats, normal: Floats, found: Floats) -> None:
    """The point p' of a part, whose frame is (3, 4), closest to a scene point p (3,) with normal n_p (3,).

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
    found[1] = (1.0 - EPSILON * cosine) * found[0]
    found[2] = cosine


@njit(cache=True, error_model="numpy")
def sums(
    model: Model, frames: Floats, rays: Singles, limit: float, forces: Floats, moments: Floats, numbers: Floats
) -> None:
    """Sum up over the group of every part, the part and all that hangs on it: forces (p, 3) in m^2, moments (p, 3) about
    its joint in m^3 along the world's axes, and how many points (p,); overwritten.  [Hybrid Eq. 38-40]

    A point further than `limit` metres from every part belongs to none.
    """
    forces[:] = 0.0
    moments[:] = 0.0
    numbers[:] = 0.0
    reach = np.empty(frames.shape[0])  # no point of a part is further from where its axis begins
    bases = np.empty((frames.shape[0], 3))
    for part in range(frames.shape[0]):
        reach[part] = model.lengths[part]
        for k in range(4):
            reach[part] = max(reach[part], model.lengths[part] + model.radii[part, k])
        for row in range(3):
            bases[part, row] = frames[part, row, 3]
            for k in range(3):
                bases[part, row] += frames[part, row, k] * model.bases[part, k]
    point, normal, found, best = np.empty(3), np.empty(3), np.empty(TOUCHED), np.empty(TOUCHED)
    for i in range(rays.shape[1]):
        depth = 0.5 * (rays[9, i] + rays[10, i])
        for k in range(3):
            point[k] = rays[k, i] + depth * rays[3 + k, i]
            normal[k] = rays[6 + k, i]
        part, best[1] = 0, np.inf
        for other in range(frames.shape[0]):
            apart = 0.0
            for k in range(3):
                apart += (point[k] - bases[other, k]) ** 2
            least = np.sqrt(apart) - reach[other]
            if (1.0 - EPSILON) * least >= best[1]:
                continue
            closest(model, frames[other], other, point, normal, found)
            if found[1] < best[1]:
                part = other
                for k in range(TOUCHED):
                    best[k] = found[k]
        if not best[0] < limit:
            continue
        size = min(max(best[2], 0.0) * best[0], TRUNCATED_M) ** 2 / max(best[0], 1e-9)  # Eq. 32, per |pp'|
        fx, fy, fz = size * (point[0] - best[3]), size * (point[1] - best[4]), size * (point[2] - best[5])
        up = part
        while up >= 0:
            x, y, z = best[3] - frames[up, 0, 3], best[4] - frames[up, 1, 3], best[5] - frames[up, 2, 3]
            forces[up, 0] += fx
            forces[up, 1] += fy
            forces[up, 2] += fz
            moments[up, 0] += y * fz - z * fy
            moments[up, 1] += z * fx - x * fz
            moments[up, 2] += x * fy - y * fx
            numbers[up] += 1.0
            up = model.parent[up]


@njit(cache=True, error_model="numpy")
def refine_as_printed(
    model: Model,
    rays: Singles,
    weights: Weights,
    iterations: int,
    position: Floats,
    rotation: Floats,
    values: Floats,
    target_position: Floats,
    target_rotation: Floats,
    target_values: Floats,
) -> None:
    """Move a pose in place: position (3,), rotation (3, 3) and values (d,).  As `refine`, but nothing holds it.

    Of the weights only the limit counts; the paper has no target.
    """
    count = model.parent.shape[0]
    frames = np.empty((count, 3, 4))
    forces, moments, numbers = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    angles, turn, before = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for _ in range(iterations):
        place(model, position, rotation, values, frames)
        sums(model, frames, rays, weights.limit, forces, moments, numbers)
        for part in range(count):
            many = max(numbers[part], 1.0)
            for k in range(3):
                angles[k] = 0.0
                for row in range(3):
                    angles[k] += frames[part, row, k] * moments[part, row] * RHO / many
            start = model.first[part]
            if part == 0:
                for k in range(3):
                    position[k] += forces[0, k] * LAMBDA / many
                rotation_of(angles, turn)
                before[:] = rotation
                for row in range(3):
                    for k in range(3):
                        rotation[row, k] = 0.0
                        for n in range(3):
                            rotation[row, k] += before[row, n] * turn[n, k]
            elif model.kind[part] == 1:
                values[start] += angles[model.axis[part]]
            elif model.kind[part] == 3:
                for k in range(3):
                    values[start + k] += angles[k]
        for k in range(values.shape[0]):
            values[k] = min(max(values[k], model.low[k]), model.high[k])  # Eq. 41
