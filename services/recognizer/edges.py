"""What the beginning and the end of postures look like, for a stream that has to find them."""

from collections.abc import Sequence

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.model import EDGE

MOST = 0.95  # of the examples


def edges_of(labels: Sequence[int], count: int, vectors: Sequence[Floats], rate: float) -> tuple[Floats, float, float]:
    """`edges` (n, 2, d), `calm` and `slow` of a `PostureModel`.

    labels: index of each example's posture, below `count`.  vectors: (T_i, d), T_i of 2 or more, in the codebook's
    coordinates at `rate` frames per second.
    """
    ends = [(some[:EDGE], some[-EDGE:]) for some in vectors]
    edges = np.array([[_mean(ends, labels, k, end) for end in (0, 1)] for k in range(count)])
    distances, speeds = [], []
    for pair, of in zip(ends, labels, strict=True):
        for end in (0, 1):
            distances.append(np.linalg.norm(pair[end] - edges[of, end], axis=1))
            speeds.append(np.linalg.norm(np.diff(pair[end], axis=0), axis=1) * rate)
    calm, slow = (float(np.quantile(np.concatenate(values), MOST)) for values in (distances, speeds))
    return edges, calm, slow


def reach_of(labels: Sequence[int], count: int, vectors: Sequence[Floats]) -> Floats:
    """(n,) the largest distance from its first frame that all but one in twenty examples (T_i, d) of a posture come to."""
    largest = np.array([np.linalg.norm(some - some[0], axis=1).max() for some in vectors])
    of = np.array(labels)
    return np.array([np.quantile(largest[of == k], 1.0 - MOST) for k in range(count)])


def _mean(ends: Sequence[tuple[Floats, Floats]], labels: Sequence[int], k: int, end: int) -> Floats:
    own: Floats = np.concatenate([pair[end] for pair, of in zip(ends, labels, strict=True) if of == k]).mean(axis=0)
    return own
