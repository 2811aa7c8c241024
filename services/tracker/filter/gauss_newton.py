"""Damped Gauss-Newton refinement of a pose, from one 6 x 6 wrench matrix per part; replaces [Hybrid V-B] by default."""

# Paper (replaced): V-B moves by forces and moments, Eq. 32-40; here by least squares on the residuals of the same rays.

import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints, Ints32
from zenocap.common.jit import finite_leaf_kernel, kernel, leaf_kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, forward_kinematics
from zenocap.services.tracker.body.jacobian import ROOT, add_target_gradient, apply_step, joint_screws, normal_equations
from zenocap.services.tracker.evidence.field import DistanceField, axis_point, outside_at
from zenocap.services.tracker.evidence.rays import Weights, nearest_parts, ray_contact, robust_weight
from zenocap.services.tracker.filter.cholesky import cholesky_solve
from zenocap.services.tracker.parameters import AXIS_SAMPLES, CONVERGED_STEP, OUTSIDE_WEIGHT


@kernel
def accumulate_wrenches(
    model: BodyModel,
    frames: Floats,
    rays: Floats32,
    field: DistanceField,
    weights: Weights,
    matrices: Floats,
    gradients: Floats,
    distances: Floats32,
    parts: Ints32,
) -> None:
    """Sum every part's wrench matrix (p, 6, 6), lower triangle, and gradient (p, 6) about the root's origin.

    distances, parts: (n,) of the rays, overwritten.
    """
    count = frames.shape[0]
    matrices[:] = 0.0
    gradients[:] = 0.0
    nearest_parts(model, frames, rays, distances, parts)
    first, order = np.zeros(count + 1, dtype=np.int64), np.empty(rays.shape[1], dtype=np.int64)
    for i in range(rays.shape[1]):
        first[parts[i] + 1] += 1
    for part in range(count):
        first[part + 1] += first[part]
    filled = first[:count].copy()
    for i in range(rays.shape[1]):
        order[filled[parts[i]]] = i
        filled[parts[i]] += 1
    for part in range(count):
        _accumulate_part(
            model, frames, part, rays, order[first[part] : first[part + 1]], weights, matrices[part], gradients[part]
        )
    found, wrench = np.empty(4), np.empty(6)
    for part in range(count):
        for n in range(len(AXIS_SAMPLES)):
            x, y, z = axis_point(model, frames[part], part, AXIS_SAMPLES[n])
            for k in range(field.at.shape[0]):
                if outside_at(field, k, x, y, z, found) and found[0] < weights.limit:
                    weight = OUTSIDE_WEIGHT * weights.ray_weight * min(1.0, weights.spread / found[0]) / weights.spread**2
                    x0, y0, z0 = x - frames[0, 0, 3], y - frames[0, 1, 3], z - frames[0, 2, 3]
                    _add_residual(x0, y0, z0, found, weight, wrench, matrices[part], gradients[part])


@finite_leaf_kernel
def _accumulate_part(
    model: BodyModel,
    frames: Floats,
    part: int,
    rays: Floats32,
    own: Ints,
    weights: Weights,
    matrix: Floats,
    gradient: Floats,
) -> None:
    """Add the rays of one part, indices `own` (n,), to its wrench matrix (6, 6) and gradient (6,), summed in registers."""
    f = frames[part]
    ox, oy, oz = frames[0, 0, 3], frames[0, 1, 3], frames[0, 2, 3]
    spread, limit, ray_weight = weights.spread, weights.limit, weights.ray_weight
    p0 = p1 = p2 = p3 = p4 = p5 = 0.0
    m00 = m10 = m11 = m20 = m21 = m22 = m30 = m31 = m32 = m33 = 0.0
    m40 = m41 = m42 = m43 = m44 = m50 = m51 = m52 = m53 = m54 = m55 = 0.0
    for k in range(own.shape[0]):
        distance, gap, x, y, z, _, a, b, c = ray_contact(model, f, part, rays, own[k])
        weight = ray_weight * robust_weight(distance, gap, spread, limit)
        x, y, z = x - ox, y - oy, z - oz
        d, e, g = y * c - z * b, z * a - x * c, x * b - y * a
        wa, wb, wc, wd, we, wg = weight * a, weight * b, weight * c, weight * d, weight * e, weight * g
        p0, p1, p2 = p0 + gap * wa, p1 + gap * wb, p2 + gap * wc
        p3, p4, p5 = p3 + gap * wd, p4 + gap * we, p5 + gap * wg
        m00, m10, m11 = m00 + wa * a, m10 + wb * a, m11 + wb * b
        m20, m21, m22 = m20 + wc * a, m21 + wc * b, m22 + wc * c
        m30, m31, m32, m33 = m30 + wd * a, m31 + wd * b, m32 + wd * c, m33 + wd * d
        m40, m41, m42, m43, m44 = m40 + we * a, m41 + we * b, m42 + we * c, m43 + we * d, m44 + we * e
        m50, m51, m52, m53 = m50 + wg * a, m51 + wg * b, m52 + wg * c, m53 + wg * d
        m54, m55 = m54 + wg * e, m55 + wg * g
    gradient[0], gradient[1], gradient[2], gradient[3], gradient[4], gradient[5] = p0, p1, p2, p3, p4, p5
    matrix[0, 0], matrix[1, 0], matrix[1, 1] = m00, m10, m11
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = m20, m21, m22
    matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[3, 3] = m30, m31, m32, m33
    matrix[4, 0], matrix[4, 1], matrix[4, 2], matrix[4, 3], matrix[4, 4] = m40, m41, m42, m43, m44
    matrix[5, 0], matrix[5, 1], matrix[5, 2], matrix[5, 3], matrix[5, 4], matrix[5, 5] = m50, m51, m52, m53, m54, m55


@leaf_kernel
def _add_residual(
    x: float, y: float, z: float, found: Floats, weight: float, wrench: Floats, matrix: Floats, gradient: Floats
) -> None:
    """Add one residual to a part's wrench matrix and gradient.

    x, y, z: sample of the body relative to the root, metres.  found: (4,) as `outside_at` writes it.
    """
    gap, n0, n1, n2 = found[0], found[1], found[2], found[3]
    wrench[0], wrench[1], wrench[2] = n0, n1, n2
    wrench[3], wrench[4], wrench[5] = y * n2 - z * n1, z * n0 - x * n2, x * n1 - y * n0
    for row in range(6):
        gradient[row] += weight * gap * wrench[row]
        for column in range(row + 1):
            matrix[row, column] += weight * wrench[row] * wrench[column]


@kernel
def refine(
    model: BodyModel,
    rays: Floats32,
    field: DistanceField,
    weights: Weights,
    iterations: int,
    pose: RootedPose,
    target: RootedPose,
) -> None:
    """Refine a pose in place by damped Gauss-Newton, with a Gaussian prior at the target.

    At most `iterations` steps; ends with the first short one.
    """
    count, dof = model.parent.shape[0], ROOT + pose.values.shape[0]
    frames = np.empty((count, 3, 4))
    matrices, gradients = np.empty((count, 6, 6)), np.empty((count, 6))
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    a, b = np.empty((dof, dof)), np.empty(dof)
    distances, parts = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    for _ in range(iterations):
        forward_kinematics(model, pose, frames)
        accumulate_wrenches(model, frames, rays, field, weights, matrices, gradients, distances, parts)
        joint_screws(model, frames, screws, owner)
        normal_equations(model, screws, owner, matrices, gradients, a, b)
        for k in range(dof):
            a[k, k] += weights.precision[k] + 1e-6
        add_target_gradient(model, frames, pose, target, weights.precision, b)
        if not cholesky_solve(a, b):
            return
        apply_step(model, frames, b, pose)
        if np.abs(b).max() < CONVERGED_STEP:
            return
