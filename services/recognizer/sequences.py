"""Sequences of feature vectors made ready: short gaps bridged, another rate."""

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats

MAX_GAP_S = 0.25  # nothing is made up across a longer gap


def bridged(features: Floats, rate: float, start_s: float = 0.0) -> Floats:
    """Feature vectors (T, d) with rows that are not finite replaced by straight lines, at the ends held.

    rate: rows per second.  start_s: time of the first row, for errors.  Raises ValueError that says from when to when a
    gap of more than MAX_GAP_S seconds is.
    """
    known = np.asarray(np.isfinite(features).all(axis=1))
    if known.all():
        return features
    for start, end in gaps_of(known):
        if end - start > MAX_GAP_S * rate:
            gap = f"no angles from {start_s + start / rate:.2f} s to {start_s + end / rate:.2f} s"
            raise ValueError(f"{gap}: allowed: gaps of at most {MAX_GAP_S:g} s")
    rows, there = np.arange(len(features)), np.flatnonzero(known)
    return np.stack([np.interp(rows, there, features[there, k]) for k in range(features.shape[1])], axis=1)


def gaps_of(known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row and row after the last of every run of rows that are not known."""
    edges = np.flatnonzero(np.diff((~known).astype(np.int8), prepend=0, append=0))
    return [(int(start), int(end)) for start, end in zip(edges[::2], edges[1::2], strict=True)]


def resampled(features: Floats, rate: float, wanted: float) -> Floats:
    """Feature vectors (T, d) at `rate` rows per second as (T', d) at `wanted`, in straight lines, from the first row on."""
    if rate == wanted or len(features) < 2:
        return features
    count = int(np.floor((len(features) - 1) * wanted / rate + 1e-6)) + 1
    at = np.minimum(np.arange(count) * (rate / wanted), len(features) - 1)
    rows = np.arange(len(features))
    return np.stack([np.interp(at, rows, features[:, k]) for k in range(features.shape[1])], axis=1)
