"""Regions during training: all eigenvectors of every region's covariance.  [Hybrid IV]"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.services.tracker.parameters import PRIOR_CENTRE_WEIGHT, PRIOR_CLAMP, PRIOR_DEVIATION_FLOOR_DEG

VARIANCE_FLOOR = np.radians(PRIOR_DEVIATION_FLOOR_DEG) ** 2  # radians squared: least variance of a coordinate


@dataclass(frozen=True)
class PriorRegions:
    """Regions during training.

    centres: (M, d) radians.  vectors: (M, d, d) eigenvectors of Sigma_i as columns, greatest first.
    spectrum: (M, d) eigenvalues, radians squared, at least VARIANCE_FLOOR.
    """

    centres: Floats
    vectors: Floats
    spectrum: Floats


def fit_regions(poses: Floats, labels: Ints, count: int, least: int, distances: Floats) -> PriorRegions:
    """Centroid and local PCA of every region's poses.  [Hybrid Eq. 12-14]

    poses: (T, d) radians, labels: (T,) their regions, 0 to count - 1, distances: (T,) to their regions.  A region of
    fewer than `least` poses restarts at a pose far from its region, with the median spectrum.
    """
    d = poses.shape[1]
    regions = PriorRegions(np.empty((count, d)), np.empty((count, d, d)), np.empty((count, d)))
    members = np.bincount(labels, minlength=count)
    small = np.flatnonzero(members < least)
    for region in np.flatnonzero(members >= least):
        _fit(regions, int(region), poses[labels == region])
    # Paper (added): a region without enough poses restarts at a pose far from its own.
    if small.size:
        median_spectrum = np.median(
            [regions.spectrum[k] for k in np.flatnonzero(members >= least)] or [np.full(d, VARIANCE_FLOOR)], axis=0
        )
        for region, pose in zip(small, _far_apart(poses, distances, small.size), strict=True):
            _fit(regions, int(region), poses)
            regions.centres[region], regions.spectrum[region] = pose, median_spectrum
    return regions


def distances_to(regions: PriorRegions, poses: Floats, dims: int) -> tuple[Floats, Floats]:
    """Distances of poses (T, d) to subspaces of `dims` dimensions, and their reconstruction errors: (T, M) radians squared.

    The distances are those of `model.distances`.
    """
    count, d = regions.centres.shape
    # Two large products instead of two small ones per region, for which threads would mostly wait.
    axes = regions.vectors[:, :, :dims].transpose(1, 0, 2).reshape(d, count * dims)
    z = (poses @ axes).reshape(-1, count, dims) - np.einsum("kd,dkj->kj", regions.centres, axes.reshape(d, count, dims))
    squared = np.sum(poses**2, axis=1)[:, None] - 2 * poses @ regions.centres.T + np.sum(regions.centres**2, axis=1)
    within = np.sum(z**2, axis=2)
    beyond = np.maximum(np.abs(z) - PRIOR_CLAMP * np.sqrt(regions.spectrum[:, :dims]), 0.0)
    lost = np.maximum(squared - within, 0.0) + np.sum(beyond**2, axis=2)
    # Paper (corrected): Eq. 9 has no term for the distance to the centre within the unbounded subspace.
    return lost + PRIOR_CENTRE_WEIGHT * within, lost


def log_densities(regions: PriorRegions, poses: Floats) -> Floats:
    """log b_j(x_t) (T, M): every region a Gaussian with its full, floored covariance."""
    result = np.empty((len(poses), len(regions.centres)))
    constant = poses.shape[1] * np.log(2 * np.pi)
    for region, (centre, vectors, spectrum) in enumerate(
        zip(regions.centres, regions.vectors, regions.spectrum, strict=True)
    ):
        z = (poses - centre) @ vectors
        result[:, region] = -0.5 * (np.sum(z**2 / spectrum, axis=1) + np.log(spectrum).sum() + constant)
    return result


def _fit(regions: PriorRegions, region: int, members: Floats) -> None:
    centre = members.mean(axis=0)
    from_centre = members - centre
    spectrum, vectors = np.linalg.eigh(from_centre.T @ from_centre / len(members))
    regions.centres[region] = centre
    regions.vectors[region] = vectors[:, ::-1]
    # Paper (corrected): Sigma has no lower bound, and is singular in a region of few poses.
    regions.spectrum[region] = np.maximum(spectrum[::-1], VARIANCE_FLOOR)


def _far_apart(poses: Floats, distances: Floats, count: int) -> Floats:
    """`count` poses, each with the greatest distance from its region and from those already taken."""
    left = distances.copy()
    taken = np.empty((count, poses.shape[1]))
    for k in range(count):
        taken[k] = poses[int(np.argmax(left))]
        left = np.minimum(left, np.sum((poses - taken[k]) ** 2, axis=1))
    return taken
