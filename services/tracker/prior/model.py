"""Motion prior: regions of poses, a subspace for each, transitions.  [Hybrid IV]

d is the number of coordinates of a pose (`zenocap.common.body.coordinates`), m that of a subspace, M that of the regions.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from zenocap.common.arrays import Floats, Ints
from zenocap.services.tracker.parameters import PRIOR_CENTRE_WEIGHT, PRIOR_CLAMP
from zenocap.services.tracker.prior.sampling import CompiledPrior

Names = Annotated[tuple[Annotated[str, Meta(max_length=4096)], ...], Meta(max_length=10_000)]
Radians = Annotated[float, Meta(ge=0, le=100)]


class Reconstruction(Struct, frozen=True, forbid_unknown_fields=True):
    """Reconstruction errors with a number of regions, radians: root mean square over frames and coordinates.

    held: on held-out motion.
    """

    regions: Annotated[int, Meta(ge=1, le=10_000)]
    training: Radians
    held: Radians


class PriorTraining(Struct, frozen=True, forbid_unknown_fields=True):
    """Provenance of a prior, as in its file.

    motions: names.  held: names of motions only measured on; empty where stretches of the motions were held out.
    frames: used, mirrored ones included.  errors: by number of regions, the paper's Fig. 4.
    distances: (3,) the 50th, 90th and 99th percentile of held-out poses' distances from the prior, radians.
    """

    motions: Names
    held: Names
    frames: Annotated[int, Meta(ge=0, le=1 << 40)]
    mirrored: bool
    seed: int
    errors: Annotated[tuple[Reconstruction, ...], Meta(max_length=1000)]
    distances: tuple[Radians, Radians, Radians]


@dataclass(frozen=True, eq=False)
class Prior:
    """Poses of a kind of motion and transitions between them, without the root.

    anatomy: its name.  names: (d,) of the coordinates.  rate: frames per second that `transitions` are for.
    centres: (M, d) r_i, radians.  bases: (M, d, m) P_i, orthonormal columns.  variances: (M, m) the diagonal of
    Lambda_i, radians squared, falling.  residuals: (M, d) remaining variance of every coordinate, radians squared.
    transitions: (M, M) a_ij from i to j, rows sum to 1.  occupancy: (M,) fraction of the frames, sums to 1.
    speeds: (d,) root mean square of every coordinate's velocity, radians per second.
    """

    anatomy: str
    names: tuple[str, ...]
    rate: float
    centres: Floats
    bases: Floats
    variances: Floats
    residuals: Floats
    transitions: Floats
    occupancy: Floats
    speeds: Floats
    training: PriorTraining

    @property
    def regions(self) -> int:
        return len(self.centres)

    @property
    def dimensions(self) -> int:
        return len(self.bases[0, 0])

    @cached_property
    def compiled(self) -> CompiledPrior:
        """Layout for compiled functions."""
        cumulative = np.cumsum(self.transitions, axis=1)
        cumulative[:, -1] = 1.0
        axes = np.ascontiguousarray(self.bases.transpose(0, 2, 1))
        return CompiledPrior(np.ascontiguousarray(self.centres), axes, np.sqrt(self.variances), cumulative)


def project(prior: Prior, region: int, poses: Floats) -> Floats:
    """Coordinates (..., m) of poses (..., d) in a region's subspace, clamped to PRIOR_CLAMP deviations.  [Hybrid Eq. 18]"""
    # Paper (corrected): Eq. 18 is not clamped; a pose far from the region would have values that were never observed.
    z = (poses - prior.centres[region]) @ prior.bases[region]
    limit = PRIOR_CLAMP * np.sqrt(prior.variances[region])
    clamped: Floats = np.clip(z, -limit, limit)
    return clamped


def reconstruct(prior: Prior, region: int, z: Floats) -> Floats:
    """Poses (..., d) in radians from coordinates (..., m) in a region's subspace.  [Hybrid Eq. 19]"""
    poses: Floats = prior.centres[region] + z @ prior.bases[region].T
    return poses


def distances(prior: Prior, poses: Floats) -> Floats:
    """d(x, r_i) (T, M) in radians squared, of poses (T, d).  [Hybrid Eq. 9, 10]

    The residual of the clamped projection, and PRIOR_CENTRE_WEIGHT of the squared distance to the centre within the
    subspace.
    """
    found = np.empty((len(poses), prior.regions))
    for region in range(prior.regions):
        left = poses - reconstruct(prior, region, project(prior, region, poses))
        within = (poses - prior.centres[region]) @ prior.bases[region]
        # Paper (corrected): Eq. 9 has no term for the centre; a region, unbounded, would claim poses far from its own.
        found[:, region] = np.sum(left**2, axis=1) + PRIOR_CENTRE_WEIGHT * np.sum(within**2, axis=1)
    return found


def assign(prior: Prior, poses: Floats) -> Ints:
    """(T,) region of smallest distance of every pose (T, d).  [Hybrid Eq. 8]"""
    regions: Ints = np.argmin(distances(prior, poses), axis=1)
    return regions


def reconstruct_poses(prior: Prior, poses: Floats) -> Floats:
    """Poses (T, d) reconstructed by their regions."""
    regions = assign(prior, poses)
    result = np.empty_like(poses)
    for region in np.unique(regions):
        members = regions == region
        result[members] = reconstruct(prior, int(region), project(prior, int(region), poses[members]))
    return result
