"""Training of regions, subspaces and transitions by expectation-maximization.  [Hybrid IV, Eq. 1-17]"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import kmeans2

from zenocap.common.arrays import Floats, Ints
from zenocap.services.tracker.parameters import EM_MAX_ITERATIONS, EM_TOLERANCE, K_MEANS_ITERATIONS
from zenocap.services.tracker.prior.forward_backward import expectation
from zenocap.services.tracker.prior.regions import PriorRegions, distances_to, fit_regions, log_densities


@dataclass(frozen=True)
class LearnedRegions:
    """Result of a training.  transitions: (M, M).  labels: (T,) regions of the poses of all sequences, one after another.

    errors: mean reconstruction error after every iteration, radians, root mean square over frames and coordinates.
    log_likelihood: of all sequences.
    """

    regions: PriorRegions
    transitions: Floats
    labels: Ints
    errors: tuple[float, ...]
    log_likelihood: float


def learn(sequences: Sequence[Floats], count: int, dims: int, rng: np.random.Generator) -> LearnedRegions:
    """At most `count` regions with subspaces of `dims` dimensions, from sequences of poses (T_k, d) in radians.

    Fewer than `count` where some keep fewer than dims + 1 poses, or where fewer poses differ.
    """
    poses = np.concatenate(sequences)
    count = min(count, len(poses) // (dims + 1), len(np.unique(poses, axis=0)))
    # Paper (replaced): IV starts with random poses as centres and Sigma = I; here with k-means and local PCA.
    labels = _k_means(poses, count, rng)
    regions = fit_regions(poses, labels, count, dims + 1, np.zeros(len(poses)))
    # Paper (corrected): a_ij is 1 / M^2 at first, and its rows do not sum to 1.
    transitions = np.full((count, count), 1.0 / count)
    errors: list[float] = []
    squared, _ = distances_to(regions, poses, dims)
    for _ in range(EM_MAX_ITERATIONS):
        transitions, _ = reestimate_transitions(sequences, regions, transitions)
        regions = fit_regions(poses, np.argmin(squared, axis=1), count, dims + 1, squared.min(axis=1))
        squared, lost = distances_to(regions, poses, dims)
        errors.append(_error(squared, lost, poses))
        if len(errors) > 1 and abs(errors[-2] - errors[-1]) < EM_TOLERANCE * errors[-2]:
            break
    # Paper (added): regions with too few poses for a subspace are dropped.
    regions, labels = _drop_small_regions(regions, poses, dims)
    if len(regions.centres) < count:
        transitions = np.full((len(regions.centres), len(regions.centres)), 1.0 / len(regions.centres))
    transitions, log_likelihood = reestimate_transitions(sequences, regions, transitions)
    return LearnedRegions(regions, transitions, labels, tuple(errors), log_likelihood)


def reestimate_transitions(sequences: Sequence[Floats], regions: PriorRegions, transitions: Floats) -> tuple[Floats, float]:
    """Transitions (M, M) after one expectation, and the log likelihood before.  [Hybrid Eq. 17]"""
    count = len(transitions)
    # Paper (added): one pseudo-count in every row of Eq. 17 keeps transitions above zero.
    xi = np.full((count, count), 1.0 / count)
    log_likelihood = 0.0
    # Paper (added): IV has one sequence; here several, without transitions between them.
    for sequence in sequences:
        expected = expectation(transitions, log_densities(regions, sequence))
        xi += expected.xi
        log_likelihood += expected.log_likelihood
    # The sum of xi over j is gamma's, over all frames but the last; so rows sum to 1 to rounding.
    rows: Floats = xi / xi.sum(axis=1, keepdims=True)
    return rows, log_likelihood


def error_of(regions: PriorRegions, poses: Floats, dims: int) -> float:
    """Mean reconstruction error of poses (T, d): root mean square over frames and coordinates, radians."""
    return _error(*distances_to(regions, poses, dims), poses)


def _error(squared: Floats, lost: Floats, poses: Floats) -> float:
    labels = np.argmin(squared, axis=1)
    return float(np.sqrt(np.take_along_axis(lost, labels[:, None], axis=1).sum() / poses.size))


def _k_means(poses: Floats, count: int, rng: np.random.Generator) -> Ints:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="One of the clusters is empty")  # empty regions restart
        _, labels = kmeans2(poses, count, iter=K_MEANS_ITERATIONS, minit="++", rng=rng)
    return np.asarray(labels, dtype=np.int64)


def _drop_small_regions(regions: PriorRegions, poses: Floats, dims: int) -> tuple[PriorRegions, Ints]:
    """Regions with at least dims + 1 poses, and the labels of the poses among them."""
    while True:
        labels = np.argmin(distances_to(regions, poses, dims)[0], axis=1)
        keep = np.bincount(labels, minlength=len(regions.centres)) >= dims + 1
        if np.all(keep):
            return regions, labels
        regions = PriorRegions(regions.centres[keep], regions.vectors[keep], regions.spectrum[keep])
