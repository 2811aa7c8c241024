"""Coefficients of the verdict, fitted to simulated people; printed for `tools/verdict/parameters.py`."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls

from benchmarks.verdict.truth import Judged
from zenocap.common.arrays import Floats
from zenocap.tools.verdict.features import FEATURES
from zenocap.tools.verdict.parameters import LOST_ERROR_M
from zenocap.tools.verdict.verdict import LOST, terms, used_features

RIDGE = 1.0  # weight of the squared coefficients, in squared errors of ln error
LEAST_ERROR_M = 0.02  # smaller ones are noise of the joints' definition
MOST_LOST = 0.6  # share of a stretch without pose, beyond which its poses tell little


def design(kind: str, every: Sequence[Judged]) -> tuple[Floats, Floats]:
    """(n, used features) terms of stretches with truth, and (n,) ln of the error of their poses, mm."""
    columns = [FEATURES.index(name) for name in used_features(kind)]
    rows, targets = [], []
    for one in every:
        for stretch, error in zip(one.stretches, one.errors, strict=True):
            lost = stretch.values[LOST]
            if not np.isfinite(error) or lost > MOST_LOST:
                continue
            tracked = float(np.clip((error - lost * LOST_ERROR_M) / (1.0 - lost), LEAST_ERROR_M, LOST_ERROR_M))
            rows.append(terms(stretch.values[None])[0, columns])
            targets.append(np.log(1e3 * tracked))
    return np.array(rows), np.array(targets)


def fitted(kind: str, every: Sequence[Judged]) -> tuple[float, dict[str, float]]:
    """Constant, and coefficients that are not 0, by least squares with coefficients of 0 or more."""
    rows, targets = design(kind, every)
    names = used_features(kind)
    matrix = np.hstack([np.ones((len(rows), 1)), -np.ones((len(rows), 1)), rows])
    ridge = np.sqrt(RIDGE) * np.eye(matrix.shape[1])[2:]
    found, _ = nnls(np.vstack([matrix, ridge]), np.concatenate([targets, np.zeros(len(ridge))]))
    coefficients = {name: round(float(value), 3) for name, value in zip(names, found[2:], strict=True) if value >= 0.005}
    return round(float(found[0] - found[1]), 3), coefficients


def baseline(coefficients: dict[str, float], every: Sequence[Judged]) -> dict[str, float]:
    """By feature: median of its share of ln error in the stretches of takes that are good in truth."""
    values = np.array([s.values for one in every if one.truth.rating == "good" for s in one.stretches])
    medians = np.median(terms(values), axis=0)
    return {name: round(weight * float(medians[FEATURES.index(name)]), 3) for name, weight in coefficients.items()}
