"""Transitions over another time than they were learnt for."""

import numpy as np
from scipy.linalg import fractional_matrix_power

from common.body.anatomy import Floats

MAX_NEGATIVE = 0.02  # of a row's probability; beyond it there is no chain of which the root could be


def power_of_transitions(transitions: Floats, exponent: float) -> Floats:
    """A^exponent of a stochastic matrix (M, M), exponent > 0, again stochastic: probabilities after `exponent` steps.

    Whole powers are exact.  The rest is the principal root where that is stochastic but for rounding and a little beyond;
    otherwise, since not every chain has a root, staying with 1 - exponent and stepping with exponent.
    """
    whole = int(np.floor(exponent))
    result = np.linalg.matrix_power(transitions, whole)
    if exponent > whole:
        result = result @ _root(transitions, exponent - whole)
    return stochastic(result)


def stochastic(transitions: Floats) -> Floats:
    """Rows without negative entries, summing to 1; rows of nothing become equal chances."""
    positive = np.maximum(transitions, 0.0)
    sums = positive.sum(axis=1, keepdims=True)
    rows: Floats = np.where(sums > 0, positive / np.where(sums > 0, sums, 1.0), 1.0 / transitions.shape[1])
    return rows


def _root(transitions: Floats, exponent: float) -> Floats:
    """A^exponent for an exponent between 0 and 1."""
    root = np.asarray(fractional_matrix_power(transitions, exponent))
    amiss = np.maximum(-root.real, 0.0).sum(axis=1) + np.abs(root.imag).sum(axis=1)
    if np.all(amiss < MAX_NEGATIVE):  # not so where the root is NaN
        return stochastic(root.real)
    lazy: Floats = (1 - exponent) * np.eye(len(transitions)) + exponent * transitions
    return lazy
