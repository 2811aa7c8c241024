"""Refinement of a pose by simulated force and moment, as printed.  [Hybrid V-B, Eq. 32-41]

Every scene point is assigned to its corresponding part, see `closest_points`.  Its force is rho(mF |pp'|).  Moments are
summed over a part's group and added to the angles of its joint.  `refine_by_force` is another form with the fixed points
of Gauss-Newton.
"""

import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, forward_kinematics
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.closest_points import (
    CLOSEST_LENGTH,
    Correspondence,
    corresponding_part,
    part_capsules,
    scene_point,
)
from zenocap.services.tracker.parameters import (
    FORCE_GAIN,
    FORCE_TRUNCATION_M,
    LINEAR_FORCE_GAIN,
    LINEAR_MOMENT_GAIN,
    MOMENT_GAIN,
)


@kernel
def group_forces(
    model: BodyModel, frames: Floats, rays: Floats32, limit: float, linear: bool, by: Correspondence,
    parts: Ints, forces: Floats, moments: Floats, numbers: Floats,
) -> None:  # fmt: skip
    """Sum over the group of every part, the part and all its descendants; all overwritten.  [Hybrid Eq. 38-40]

    parts: (n,) part of every point in the last iteration, or any; overwritten with those of this one.
    linear: rho(x) = min(x, T), else min(x, T)^2, T = FORCE_TRUNCATION_M.
    forces: (p, 3) m, or m^2 with the square.  moments: (p, 3) the same times m, about its joint, along the world's axes.
    numbers: (p,) of points.  A point farther than `limit` metres from every part belongs to none.
    """
    forces[:] = 0.0
    moments[:] = 0.0
    numbers[:] = 0.0
    capsules = np.empty((frames.shape[0], 5))
    part_capsules(model, frames, by.flat, capsules)
    point, normal, found, best = np.empty(3), np.empty(3), np.empty(CLOSEST_LENGTH), np.empty(CLOSEST_LENGTH)
    for i in range(rays.shape[1]):
        scene_point(rays, i, point, normal)
        part = corresponding_part(model, frames, capsules, by, parts[i], point, normal, found, best)
        parts[i] = part
        # Paper (added): with the square, a point farther than RESIDUAL_LIMIT_M from every part exerts no force.
        if not best[0] < limit:
            continue
        # Paper (open): rho of a negative mF; 0, so that surfaces that face away from each other exert no force.
        size = min(max(best[2], 0.0) * best[0], FORCE_TRUNCATION_M)
        # Paper (replaced): Eq. 32 has the rho of Eq. 31, whose argument is a square there; with force_law = "linear" none.
        size = (size if linear else size**2) / max(best[0], 1e-9)
        # Paper (corrected): Eq. 32 prints the direction from model to scene reversed; it is that of Fig. 2.
        fx, fy, fz = size * (point[0] - best[3]), size * (point[1] - best[4]), size * (point[2] - best[5])
        up = part
        while up >= 0:
            x, y, z = best[3] - frames[up, 0, 3], best[4] - frames[up, 1, 3], best[5] - frames[up, 2, 3]
            forces[up, 0] += fx
            forces[up, 1] += fy
            forces[up, 2] += fz
            # Paper (corrected): Eq. 33 prints F x L, which turns the part away; it is L x F.
            moments[up, 0] += y * fz - z * fy
            moments[up, 1] += z * fx - x * fz
            moments[up, 2] += x * fy - y * fx
            numbers[up] += 1.0
            up = model.parent[up]


@kernel
def refine_as_printed(
    model: BodyModel, rays: Floats32, weights: Weights, linear: bool, by: Correspondence, iterations: int, pose: RootedPose
) -> None:
    """Refine a pose in place by the printed force and moment.

    linear: see `group_forces`.  Of the weights only the limit counts, and only for the square: a linear force is
    truncated.  The paper has no target.
    """
    position, rotation, values = pose.position, pose.rotation, pose.values
    count = model.parent.shape[0]
    frames = np.empty((count, 3, 4))
    forces, moments, numbers = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    parts = np.zeros(rays.shape[1], np.int64)
    angles, turn, before = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    limit = np.inf if linear else weights.limit
    # Paper (open): lambda and rho have no values; gains by hand, divided by the number of points in the group.
    # Paper (corrected): Eq. 34-37 exchange lambda and rho; they are those of Eq. 38-40.
    force_gain = LINEAR_FORCE_GAIN if linear else FORCE_GAIN
    moment_gain = LINEAR_MOMENT_GAIN if linear else MOMENT_GAIN
    # Paper (open): the truncation of rho in Eq. 32 has no value; FORCE_TRUNCATION_M.
    # Paper (open): the number of iterations; ITERATIONS of `zenocap.common.rig.tracker`.
    for _ in range(iterations):
        forward_kinematics(model, pose, frames)
        group_forces(model, frames, rays, limit, linear, by, parts, forces, moments, numbers)
        for part in range(count):
            # Paper (open): Eq. 34-35 give no rho and lambda; here constants over the number of points in the group.
            many = max(numbers[part], 1.0)
            # Paper (corrected): Eq. 36 and 37 print x twice; the second component is y.
            for k in range(3):
                # Paper (open): axes of the angles to which a moment is added; those of the part, of a hinge its own.
                angles[k] = 0.0
                for row in range(3):
                    angles[k] += frames[part, row, k] * moments[part, row] * moment_gain / many
            start = model.first[part]
            if part == 0:
                for k in range(3):
                    position[k] += forces[0, k] * force_gain / many
                vector_to_matrix(angles, turn)
                _turn_root(rotation, turn, before)
            elif model.kind[part] == 1:
                values[start] += angles[model.axis[part]]
            elif model.kind[part] == 3:
                for k in range(3):
                    values[start + k] += angles[k]
        for k in range(values.shape[0]):
            values[k] = min(max(values[k], model.low[k]), model.high[k])  # Eq. 41


@leaf_kernel
def _turn_root(rotation: Floats, turn: Floats, before: Floats) -> None:
    """rotation = rotation turn, (3, 3) each, in place.  before: scratch."""
    for row in range(3):
        for k in range(3):
            before[row, k] = rotation[row, k]
    for row in range(3):
        for k in range(3):
            rotation[row, k] = 0.0
            for n in range(3):
                rotation[row, k] += before[row, n] * turn[n, k]
