"""Learning regions, subspaces and transitions together by expectation-maximization.  [Hybrid IV]

Beyond the paper: regions begin with k-means and transitions at 1/M (it prints 1/M^2); Sigma is floored; a region is
near only where its own poses are (`model.distances`); one made-up frame in every row keeps transitions above zero;
several sequences, with no transition from one to the next; regions that lose their poses begin anew.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import kmeans2

from common.body.anatomy import Floats
from services.tracker.prior.passes import expectation
from services.tracker.prior.regions import Labels, Regions, distances_to, fitted, log_densities

MAX_ROUNDS = 40
SIGNIFICANT = 2e-3  # of the average reconstruction error
K_MEANS_ROUNDS = 20


@dataclass(frozen=True)
class Learnt:
    """transitions: (M, M).  labels: (T,) the regions of the poses of all sequences, one after another.

    errors: the average reconstruction error after every round, radians, root mean square over frames and coordinates.
    log_likelihood: of all sequences.
    """

    regions: Regions
    transitions: Floats
    labels: Labels
    errors: tuple[float, ...]
    log_likelihood: float


def learn(sequences: Sequence[Floats], count: int, dims: int, rng: np.random.Generator) -> Learnt:
    """At most `count` regions with subspaces of `dims` dimensions, of sequences of poses (T_k, d) in radians.

    There are fewer than `count` where some cannot keep dims + 1 poses, or where fewer poses differ.
    """
    poses = np.concatenate(sequences)
    count = min(count, len(poses) // (dims + 1), len(np.unique(poses, axis=0)))
    labels = _k_means(poses, count, rng)
    regions = fitted(poses, labels, count, dims + 1, np.zeros(len(poses)))
    transitions = np.full((count, count), 1.0 / count)
    errors: list[float] = []
    squared, _ = distances_to(regions, poses, dims)
    for _ in range(MAX_ROUNDS):
        transitions, _ = followed(sequences, regions, transitions)
        regions = fitted(poses, np.argmin(squared, axis=1), count, dims + 1, squared.min(axis=1))
        squared, lost = distances_to(regions, poses, dims)
        errors.append(_error(squared, lost, poses))
        if len(errors) > 1 and abs(errors[-2] - errors[-1]) < SIGNIFICANT * errors[-2]:
            break
    regions, labels = _kept(regions, poses, dims)
    transitions = _started(transitions, len(regions.centres))
    transitions, log_likelihood = followed(sequences, regions, transitions)
    return Learnt(regions, transitions, labels, tuple(errors), log_likelihood)


def followed(sequences: Sequence[Floats], regions: Regions, transitions: Floats) -> tuple[Floats, float]:
    """New transitions (M, M) after one expectation, and the log likelihood before.  [Hybrid Eq. 17]"""
    count = len(transitions)
    xi = np.full((count, count), 1.0 / count)
    log_likelihood = 0.0
    for sequence in sequences:
        expected = expectation(transitions, log_densities(regions, sequence))
        xi += expected.xi
        log_likelihood += expected.log_likelihood
    # The sum of xi over j is gamma's, over all frames but the last; so rows sum to 1 to rounding.
    rows: Floats = xi / xi.sum(axis=1, keepdims=True)
    return rows, log_likelihood


def error_of(regions: Regions, poses: Floats, dims: int) -> float:
    """The average reconstruction error of poses (T, d): root mean square over frames and coordinates, radians."""
    return _error(*distances_to(regions, poses, dims), poses)


def _error(squared: Floats, lost: Floats, poses: Floats) -> float:
    labels = np.argmin(squared, axis=1)
    return float(np.sqrt(np.take_along_axis(lost, labels[:, None], axis=1).sum() / poses.size))


def _k_means(poses: Floats, count: int, rng: np.random.Generator) -> Labels:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="One of the clusters is empty")  # it begins anew
        _, labels = kmeans2(poses, count, iter=K_MEANS_ROUNDS, minit="++", rng=rng)
    return np.asarray(labels, dtype=np.int64)


def _kept(regions: Regions, poses: Floats, dims: int) -> tuple[Regions, Labels]:
    """Without the regions that have no dims + 1 poses; and the poses' regions among those that are left."""
    while True:
        labels = np.argmin(distances_to(regions, poses, dims)[0], axis=1)
        keep = np.bincount(labels, minlength=len(regions.centres)) >= dims + 1
        if np.all(keep):
            return regions, labels
        regions = Regions(regions.centres[keep], regions.vectors[keep], regions.spectrum[keep])


def _started(transitions: Floats, count: int) -> Floats:
    return transitions if len(transitions) == count else np.full((count, count), 1.0 / count)
