"""Compiled motion prior: proposals, regions and distances of poses.  [Hybrid V-A, Eq. 24-28]

Random numbers are arguments.  The functions do not allocate; they run for every particle of every frame.
"""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.jit import kernel
from zenocap.services.tracker.parameters import PRIOR_CENTRE_WEIGHT, PRIOR_CLAMP


class CompiledPrior(NamedTuple):
    """Motion prior for compiled functions.

    centres: (M, d) radians.  axes: (M, m, d) unit vectors of the subspaces.  deviations: (M, m) radians.
    cumulative: (M, M) transitions summed along rows; the last column is 1.
    """

    centres: Floats
    axes: Floats
    deviations: Floats
    cumulative: Floats


@kernel
def propose(compiled: CompiledPrior, region: int, pose: Floats, uniform: float, normals: Floats, out: Floats) -> int:
    """Draw the region that follows `region` and write a pose of it to out (d,); returns the new region.

    pose: (d,) radians, of the particle before.  uniform: within [0, 1).  normals: (m,) standard normal.
    """
    cumulative = compiled.cumulative[region]
    new, last = 0, cumulative.shape[0] - 1
    while new < last and cumulative[new] <= uniform:
        new += 1
    centre, axes, deviations = compiled.centres[new], compiled.axes[new], compiled.deviations[new]
    d = centre.shape[0]
    for k in range(d):
        out[k] = centre[k]
    for j in range(axes.shape[0]):
        z = 0.0
        for k in range(d):
            z += axes[j, k] * (pose[k] - centre[k])
        # Paper (corrected): projections and samples are unbounded, and leave the poses of the region.
        limit = PRIOR_CLAMP * deviations[j]
        z = min(max(z, -limit), limit) + deviations[j] * normals[j]
        z = min(max(z, -limit), limit)
        for k in range(d):
            out[k] += z * axes[j, k]
    return new


@kernel
def subspace_residuals(compiled: CompiledPrior, region: int, pose: Floats) -> tuple[float, float, float]:
    """Squared residuals of a pose (d,) in a region's subspace, radians squared.

    Distance from the subspace, excess of the projection over the clamp, distance from the centre within the subspace.
    """
    centre, axes, deviations = compiled.centres[region], compiled.axes[region], compiled.deviations[region]
    off = 0.0
    for k in range(centre.shape[0]):
        off += (pose[k] - centre[k]) ** 2
    beyond, within = 0.0, 0.0
    for j in range(axes.shape[0]):
        z = 0.0
        for k in range(centre.shape[0]):
            z += axes[j, k] * (pose[k] - centre[k])
        over = max(abs(z) - PRIOR_CLAMP * deviations[j], 0.0)
        off -= z * z
        beyond += over * over
        within += z * z
    return max(off, 0.0), beyond, within


@kernel
def assign(compiled: CompiledPrior, pose: Floats) -> int:
    """Region of a pose (d,) in radians.  [Hybrid Eq. 8]"""
    best, least = 0, np.inf
    for region in range(compiled.centres.shape[0]):
        off, beyond, within = subspace_residuals(compiled, region, pose)
        # Paper (corrected): Eq. 9 has no term for the centre, so that regions reach along their subspaces without end.
        squared = off + beyond + PRIOR_CENTRE_WEIGHT * within
        if squared < least:
            best, least = region, squared
    return best


@kernel
def prior_distance(compiled: CompiledPrior, pose: Floats) -> float:
    """Distance of a pose (d,) from the prior: root mean square reconstruction error over the coordinates, radians.

    `Training.distances` has its percentiles on held-out motion.
    """
    off, beyond, _ = subspace_residuals(compiled, assign(compiled, pose), pose)
    return float(np.sqrt((off + beyond) / pose.shape[0]))


@kernel
def prior_distances(compiled: CompiledPrior, poses: Floats, out: Floats) -> None:
    """Write `prior_distance` of every pose (n, d) to out (n,)."""
    for k in range(poses.shape[0]):
        out[k] = prior_distance(compiled, poses[k])
