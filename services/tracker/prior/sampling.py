"""Proposals from the prior, compiled: a new region, and a new pose in its subspace.  [Hybrid V-A, Eq. 24-28]

Chance is an argument: the caller draws the numbers.  Nothing here allocates; called for every particle of every frame.
"""

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from services.tracker.prior.tables import Tables

# Here because compiled code keeps them: a cache knows only of changes in its own file.
CLAMP = 2.5  # standard deviations from a region's centre within its subspace
NEARNESS = 0.05  # weight of the distance to the centre beside the residual's


@njit(cache=True, error_model="numpy")
def propose(tables: Tables, region: int, pose: Floats, uniform: float, normals: Floats, scale: float, out: Floats) -> int:
    """Draw the region that follows on `region` and write a pose of it to out (d,); returns the new region.

    pose: (d,) radians, the particle's last.  uniform: within [0, 1).  normals: (m,) standard normal.
    scale: of the variance in z ~ N(z', scale Lambda); the paper has 1.
    """
    cumulative = tables.cumulative[region]
    new, last = 0, cumulative.shape[0] - 1
    while new < last and cumulative[new] <= uniform:
        new += 1
    centre, axes, deviations = tables.centres[new], tables.axes[new], tables.deviations[new]
    d = centre.shape[0]
    for k in range(d):
        out[k] = centre[k]
    step = np.sqrt(scale)
    for j in range(axes.shape[0]):
        z = 0.0
        for k in range(d):
            z += axes[j, k] * (pose[k] - centre[k])
        limit = CLAMP * deviations[j]
        z = min(max(z, -limit), limit) + step * deviations[j] * normals[j]
        z = min(max(z, -limit), limit)
        for k in range(d):
            out[k] += z * axes[j, k]
    return new


@njit(cache=True, error_model="numpy")
def against(tables: Tables, region: int, pose: Floats) -> tuple[float, float, float, float]:
    """A pose (d,) against a region's subspace, all squared: its distance from it, how far its projection is beyond the
    clamp, how far from the centre (radians squared), and the last in variances."""
    centre, axes, deviations = tables.centres[region], tables.axes[region], tables.deviations[region]
    off = 0.0
    for k in range(centre.shape[0]):
        off += (pose[k] - centre[k]) ** 2
    beyond, within, in_variances = 0.0, 0.0, 0.0
    for j in range(axes.shape[0]):
        z = 0.0
        for k in range(centre.shape[0]):
            z += axes[j, k] * (pose[k] - centre[k])
        over = max(abs(z) - CLAMP * deviations[j], 0.0)
        off -= z * z
        beyond += over * over
        within += z * z
        in_variances += (z / deviations[j]) ** 2
    return max(off, 0.0), beyond, within, in_variances


@njit(cache=True, error_model="numpy")
def assign(tables: Tables, pose: Floats) -> int:
    """The region of a pose (d,) in radians, such as a refined one.  [Hybrid Eq. 8]"""
    best, least = 0, np.inf
    for region in range(tables.centres.shape[0]):
        off, beyond, within, _ = against(tables, region, pose)
        squared = off + beyond + NEARNESS * within
        if squared < least:
            best, least = region, squared
    return best


@njit(cache=True, error_model="numpy")
def distance(tables: Tables, pose: Floats) -> float:
    """How unfamiliar a pose (d,) is: root mean square over the coordinates of what its region cannot reconstruct,
    radians.  `Training.distances` says what familiar motion has."""
    off, beyond, _, _ = against(tables, assign(tables, pose), pose)
    return float(np.sqrt((off + beyond) / pose.shape[0]))


@njit(cache=True, error_model="numpy")
def all_distances(tables: Tables, poses: Floats, out: Floats) -> None:
    """`distance` of every pose (n, d), written to out (n,)."""
    for k in range(poses.shape[0]):
        out[k] = distance(tables, poses[k])


@njit(cache=True, error_model="numpy")
def log_density(tables: Tables, pose: Floats) -> float:
    """Log density of a pose (d,) per radian^d: the regions' Gaussians weighted by occupancy, each with Lambda in its
    subspace and one variance off it."""
    highest, total = -np.inf, 0.0
    for region in range(tables.centres.shape[0]):
        off, _, _, in_variances = against(tables, region, pose)
        height = tables.heights[region] - 0.5 * (in_variances + off / tables.spreads[region])
        if height > highest:
            total = total * np.exp(highest - height) + 1.0
            highest = height
        else:
            total += np.exp(height - highest)
    return float(highest + np.log(total))
