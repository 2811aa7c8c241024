"""Motion prior at another frame rate: powers of the transition matrix."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.linalg import fractional_matrix_power

from zenocap.common.arrays import Floats
from zenocap.services.tracker.parameters import MAX_NEGATIVE_TRANSITION, RATE_TOLERANCE
from zenocap.services.tracker.prior.model import Prior


def power_of_transitions(transitions: Floats, exponent: float) -> Floats:
    """A^exponent of a stochastic matrix (M, M), exponent > 0, again stochastic: probabilities after `exponent` steps.

    Whole powers are exact.  The remainder is the principal root where that is stochastic up to MAX_NEGATIVE_TRANSITION;
    otherwise, since not every chain has a root, a step with probability `exponent`.
    """
    whole = int(np.floor(exponent))
    result = np.linalg.matrix_power(transitions, whole)
    if exponent > whole:
        result = result @ _root(transitions, exponent - whole)
    return stochastic(result)


def stochastic(transitions: Floats) -> Floats:
    """Rows without negative entries, summing to 1; rows of zeros become uniform."""
    positive = np.maximum(transitions, 0.0)
    sums = positive.sum(axis=1, keepdims=True)
    rows: Floats = np.where(sums > 0, positive / np.where(sums > 0, sums, 1.0), 1.0 / transitions.shape[1])
    return rows


def _root(transitions: Floats, exponent: float) -> Floats:
    """A^exponent for an exponent between 0 and 1."""
    root = np.asarray(fractional_matrix_power(transitions, exponent))
    invalid = np.maximum(-root.real, 0.0).sum(axis=1) + np.abs(root.imag).sum(axis=1)
    if np.all(invalid < MAX_NEGATIVE_TRANSITION):  # not so where the root is NaN
        return stochastic(root.real)
    lazy: Floats = (1 - exponent) * np.eye(len(transitions)) + exponent * transitions
    return lazy


@lru_cache(maxsize=8)
def at_rate(prior: Prior, rate: float) -> Prior:
    """Prior for another number of frames per second.  Raises ValueError unless it is positive and finite.

    A nearly whole ratio of rates is taken as whole: 29.97 is half of 60, and frame times are whole nanoseconds.  Cached.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"rate = {rate}: allowed: a positive number of frames per second")
    # Paper (added): IV has one frame rate; here the transitions for another one.
    steps = prior.rate / rate
    if abs(steps - round(steps)) <= RATE_TOLERANCE * steps:
        steps = float(round(steps))
    if steps == 1.0:
        return prior
    return replace(prior, rate=rate, transitions=power_of_transitions(prior.transitions, steps))
