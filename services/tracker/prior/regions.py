"""The regions while they are learnt: all eigenvectors of every region's covariance.  [Hybrid IV]"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.tracker.prior.sampling import CLAMP, NEARNESS
from services.tracker.prior.tables import FLOOR

Labels = NDArray[np.int64]


@dataclass(frozen=True)
class Regions:
    """centres: (M, d) radians.  vectors: (M, d, d) eigenvectors of Sigma_i as columns, greatest first.
    spectrum: (M, d) eigenvalues, radians squared, at least FLOOR."""

    centres: Floats
    vectors: Floats
    spectrum: Floats


def fitted(poses: Floats, labels: Labels, count: int, least: int, distances: Floats) -> Regions:
    """Centroid and local PCA of every region's poses.  [Hybrid Eq. 12-14]

    poses: (T, d) radians, labels: (T,) their regions, 0 to count - 1, distances: (T,) to their regions.  A region of
    fewer than `least` poses begins anew, with the shape of all poses' spread, at one that is far from its region.
    """
    d = poses.shape[1]
    regions = Regions(np.empty((count, d)), np.empty((count, d, d)), np.empty((count, d)))
    members = np.bincount(labels, minlength=count)
    small = np.flatnonzero(members < least)
    for region in np.flatnonzero(members >= least):
        _fit(regions, int(region), poses[labels == region])
    if small.size:
        typical = np.median([regions.spectrum[k] for k in np.flatnonzero(members >= least)] or [np.full(d, FLOOR)], axis=0)
        for region, pose in zip(small, _far_apart(poses, distances, small.size), strict=True):
            _fit(regions, int(region), poses)
            regions.centres[region], regions.spectrum[region] = pose, typical
    return regions


def distances_to(regions: Regions, poses: Floats, dims: int) -> tuple[Floats, Floats]:
    """Of poses (T, d) to subspaces of `dims` dimensions, both (T, M) in radians squared: the distances of
    `model.distances`, and their part that is lost in reconstruction."""
    count, d = regions.centres.shape
    # Two products instead of two for each region: small ones leave the linear algebra's threads waiting for each other.
    axes = regions.vectors[:, :, :dims].transpose(1, 0, 2).reshape(d, count * dims)
    z = (poses @ axes).reshape(-1, count, dims) - np.einsum("kd,dkj->kj", regions.centres, axes.reshape(d, count, dims))
    squared = np.sum(poses**2, axis=1)[:, None] - 2 * poses @ regions.centres.T + np.sum(regions.centres**2, axis=1)
    within = np.sum(z**2, axis=2)
    beyond = np.maximum(np.abs(z) - CLAMP * np.sqrt(regions.spectrum[:, :dims]), 0.0)
    lost = np.maximum(squared - within, 0.0) + np.sum(beyond**2, axis=2)
    return lost + NEARNESS * within, lost


def log_densities(regions: Regions, poses: Floats) -> Floats:
    """log b_j(x_t) (T, M): every region a Gaussian with its full, floored covariance."""
    result = np.empty((len(poses), len(regions.centres)))
    constant = poses.shape[1] * np.log(2 * np.pi)
    for region, (centre, vectors, spectrum) in enumerate(
        zip(regions.centres, regions.vectors, regions.spectrum, strict=True)
    ):
        z = (poses - centre) @ vectors
        result[:, region] = -0.5 * (np.sum(z**2 / spectrum, axis=1) + np.log(spectrum).sum() + constant)
    return result


def _fit(regions: Regions, region: int, members: Floats) -> None:
    centre = members.mean(axis=0)
    from_centre = members - centre
    spectrum, vectors = np.linalg.eigh(from_centre.T @ from_centre / len(members))
    regions.centres[region] = centre
    regions.vectors[region] = vectors[:, ::-1]
    regions.spectrum[region] = np.maximum(spectrum[::-1], FLOOR)


def _far_apart(poses: Floats, distances: Floats, count: int) -> Floats:
    """`count` poses, each the one whose distance to its region and to those already taken is the greatest."""
    left = distances.copy()
    taken = np.empty((count, poses.shape[1]))
    for k in range(count):
        taken[k] = poses[int(np.argmax(left))]
        left = np.minimum(left, np.sum((poses - taken[k]) ** 2, axis=1))
    return taken
