"""A prior laid out for compiled code."""

from typing import NamedTuple

import numpy as np

from common.body.anatomy import Floats

FLOOR = np.radians(2.0) ** 2  # radians squared: what a coordinate varies at least


class Tables(NamedTuple):
    """centres: (M, d) radians.  axes: (M, m, d) rows are the subspace's unit vectors.  deviations: (M, m) radians.

    cumulative: (M, M) transitions summed along rows; the last column is 1.
    spreads: (M,) variance of a pose off its subspace, per direction, radians squared.
    heights: (M,) log density at the centre, times occupancy.
    """

    centres: Floats
    axes: Floats
    deviations: Floats
    cumulative: Floats
    spreads: Floats
    heights: Floats


def tables_of(
    centres: Floats, bases: Floats, variances: Floats, residuals: Floats, transitions: Floats, occupancy: Floats
) -> Tables:
    """centres: (M, d), bases: (M, d, m), variances: (M, m), residuals: (M, d), transitions: (M, M), occupancy: (M,)."""
    regions, d, m = bases.shape
    cumulative = np.cumsum(transitions, axis=1)
    cumulative[:, -1] = 1.0
    spreads = np.maximum(residuals.sum(axis=1) / max(d - m, 1), FLOOR)
    log_volume = np.log(variances).sum(axis=1) + (d - m) * np.log(spreads) + d * np.log(2 * np.pi)
    heights = np.log(np.maximum(occupancy, 1e-3 / regions)) - 0.5 * log_volume
    axes = np.ascontiguousarray(bases.transpose(0, 2, 1))
    return Tables(np.ascontiguousarray(centres), axes, np.sqrt(variances), cumulative, spreads, heights)
