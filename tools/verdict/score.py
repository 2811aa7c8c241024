"""Monotone log-linear error model.

    ln error = constant + sum over the features of coefficient * ln(1 + min(value, largest) / scale)

so that the share of each feature in the error is its term.  Frames without a pose count as LOST_ERROR_M.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.tools.verdict.features import FEATURES, Stretch
from zenocap.tools.verdict.parameters import COEFFICIENTS, CONSTANTS, LOST_ERROR_M, SCALES

KINDS = ("both-ways", "one-pass", "two-view", "poses-only")  # of evidence; each has coefficients of its own
OF_SILHOUETTES = (
    "outside", "outside, all views", "uncovered", "uncovered, all views", "apart", "cut", "hidden", "empty",
    "pieces", "flicker",
)  # fmt: skip
OF_TRACKER = ("limbs", "worst limb", "heading", "average body")
LOST = FEATURES.index("lost")


def used_features(kind: str) -> tuple[str, ...]:
    """Features that the model of a kind of evidence uses."""
    left_out = {
        "both-ways": (),
        "one-pass": ("passes",),
        "two-view": ("passes", "unused", *OF_TRACKER),
        "poses-only": ("passes", "unused", *OF_SILHOUETTES),
    }[kind]
    return tuple(name for name in FEATURES if name not in ("lost", "missing", *left_out))


def terms(values: Floats) -> Floats:
    """(n, FEATURES) of figures (n, FEATURES), without coefficients; 0 where unknown, for "lost" and "missing"."""
    scale, largest = np.array([SCALES.get(name, (1.0, 0.0)) for name in FEATURES]).T
    found: Floats = np.nan_to_num(np.log1p(np.clip(values, 0.0, largest) / scale), nan=0.0)
    return found


def contributions(kind: str, stretches: Sequence[Stretch]) -> Floats:
    """(n, FEATURES) terms of ln error of n stretches."""
    coefficients: Mapping[str, float] = COEFFICIENTS[kind]
    weights = np.array([coefficients.get(name, 0.0) for name in FEATURES])
    found: Floats = terms(np.stack([one.values for one in stretches])) * weights
    return found


def expected_errors(kind: str, stretches: Sequence[Stretch]) -> Floats:
    """(n,) expected mean errors of the joints, metres."""
    tracked = np.minimum(LOST_ERROR_M, 1e-3 * np.exp(CONSTANTS[kind] + contributions(kind, stretches).sum(axis=1)))
    lost = np.array([one.values[LOST] for one in stretches])
    found: Floats = lost * LOST_ERROR_M + (1.0 - lost) * tracked
    return found
