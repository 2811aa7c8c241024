"""The motion prior as arrays: Voronoi regions of poses, a subspace for each, transitions between them.  [Hybrid IV]

d is the number of coordinates of a pose (`common.body.coordinates`), m that of a subspace, M that of the regions.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from services.tracker.prior.rates import power_of_transitions
from services.tracker.prior.sampling import CLAMP, NEARNESS
from services.tracker.prior.tables import Tables, tables_of

NEARLY_WHOLE = 2e-3  # of a number of steps


@dataclass(frozen=True)
class Reconstruction:
    """Reconstruction errors with this many regions, in radians: root mean square over frames and coordinates.

    held: on motion that was not learnt from.
    """

    regions: int
    training: float
    held: float


@dataclass(frozen=True)
class Training:
    """What a prior was learnt from.

    motions: their names.  held: of those that were only measured on; empty where stretches of the motions were held out.
    frames: learnt from, mirrored ones included.  errors: by number of regions, the paper's Fig. 4.
    distances: (3,) the 50th, 90th and 99th percentile of held-out poses' distances to the prior, radians.
    """

    motions: tuple[str, ...]
    held: tuple[str, ...]
    frames: int
    mirrored: bool
    seed: int
    errors: tuple[Reconstruction, ...]
    distances: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Prior:
    """What poses a kind of motion has and which follow on which; all but the root.

    anatomy: its name.  names: (d,) of the coordinates.  rate: frames per second that `transitions` are for.
    centres: (M, d) r_i, radians.  bases: (M, d, m) P_i, orthonormal columns.  variances: (M, m) the diagonal of
    Lambda_i, radians squared, falling.  residuals: (M, d) variance left of every coordinate, radians squared.
    transitions: (M, M) a_ij from i to j, rows sum to 1.  occupancy: (M,) share of the frames, sums to 1.
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
    training: Training

    @property
    def regions(self) -> int:
        return len(self.centres)

    @property
    def dimensions(self) -> int:
        return len(self.bases[0, 0])

    @cached_property
    def tables(self) -> Tables:
        """The same for compiled code."""
        return tables_of(self.centres, self.bases, self.variances, self.residuals, self.transitions, self.occupancy)


def project(prior: Prior, region: int, poses: Floats) -> Floats:
    """Coordinates (..., m) of poses (..., d) in a region's subspace, clamped to 2.5 standard deviations.  [Hybrid Eq. 18]

    The paper does not clamp: a pose far from the region would be projected to where no pose was ever seen.
    """
    z = (poses - prior.centres[region]) @ prior.bases[region]
    limit = CLAMP * np.sqrt(prior.variances[region])
    clamped: Floats = np.clip(z, -limit, limit)
    return clamped


def reconstruct(prior: Prior, region: int, z: Floats) -> Floats:
    """Poses (..., d) in radians from coordinates (..., m) in a region's subspace.  [Hybrid Eq. 19]"""
    poses: Floats = prior.centres[region] + z @ prior.bases[region].T
    return poses


def distances(prior: Prior, poses: Floats) -> Floats:
    """d(x, r_i) (T, M) in radians squared, of poses (T, d).  [Hybrid Eq. 9, 10]

    The residual of the clamped projection and, which the paper leaves out, NEARNESS of the squared distance to the
    centre within the subspace: subspaces are unbounded, and without it a region claims poses far from its own.
    """
    return np.stack([_distance(prior, region, poses) for region in range(prior.regions)], axis=1)


def _distance(prior: Prior, region: int, poses: Floats) -> Floats:
    left = poses - reconstruct(prior, region, project(prior, region, poses))
    within = (poses - prior.centres[region]) @ prior.bases[region]
    distance: Floats = np.sum(left**2, axis=1) + NEARNESS * np.sum(within**2, axis=1)
    return distance


def assign(prior: Prior, poses: Floats) -> NDArray[np.int64]:
    """The region (T,) of every pose (T, d): that of the smallest distance.  [Hybrid Eq. 8]"""
    regions: NDArray[np.int64] = np.argmin(distances(prior, poses), axis=1)
    return regions


def encoded(prior: Prior, poses: Floats) -> Floats:
    """Poses (T, d) as their regions reconstruct them."""
    regions = assign(prior, poses)
    result = np.empty_like(poses)
    for region in np.unique(regions):
        members = regions == region
        result[members] = reconstruct(prior, int(region), project(prior, int(region), poses[members]))
    return result


def reconstruction_error(prior: Prior, poses: Floats) -> float:
    """Root mean square over frames and coordinates of poses (T, d) less their reconstructions, radians."""
    return float(np.sqrt(np.mean((poses - encoded(prior, poses)) ** 2)))


@lru_cache(maxsize=8)
def at_rate(prior: Prior, rate: float) -> Prior:
    """The prior for another number of frames per second.  Raises ValueError unless it is positive and finite.

    Steps that are nearly whole are whole: 29.97 is half of 60, and frame times are whole nanoseconds.  May be asked every
    frame: the last few are kept.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"rate = {rate}: allowed: a positive number of frames per second")
    steps = prior.rate / rate
    if abs(steps - round(steps)) <= NEARLY_WHOLE * steps:
        steps = float(round(steps))
    if steps == 1.0:
        return prior
    return replace(prior, rate=rate, transitions=power_of_transitions(prior.transitions, steps))
