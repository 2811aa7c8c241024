"""The codebook: feature vectors brought to one scale, and k-means on them.  [Two-view 5.1]"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits

from common.body.anatomy import Floats
from services.recognizer.examples import Scale

LEAST = 1e-3  # of the largest variance: a direction with less counts as if it had this
TRIES = 4
DIGITS = 6  # of vectors that count as different


@dataclass(frozen=True)
class Codebook:
    """mean: (d,), whitening: (d, d), codewords: (k, d): a vector f is compared with codewords as (f - mean) @ whitening."""

    mean: Floats
    whitening: Floats
    codewords: Floats


def codebook_of(sequences: Sequence[Floats], symbols: int, scale: Scale, seed: int) -> Codebook:
    """The codebook of sequences (T_i, d): `symbols` codewords, or as many as there are different vectors.

    The same sequences and seed give the same numbers: k-means runs on one thread.
    """
    vectors = np.concatenate(sequences)
    mean, whitening = standardisation(vectors, scale)
    points = (vectors - mean) @ whitening
    count = min(symbols, len(np.unique(points.round(DIGITS), axis=0)))
    with threadpool_limits(limits=1):
        found = KMeans(n_clusters=count, n_init=TRIES, random_state=seed, algorithm="lloyd").fit(points)
    return Codebook(mean, whitening, np.ascontiguousarray(found.cluster_centers_, dtype=np.float64))


def standardisation(vectors: Floats, scale: Scale) -> tuple[Floats, Floats]:
    """(d,) mean and (d, d) whitening of vectors (n, d).

    `full`: their covariance becomes the identity.  `diagonal`: every feature's variance becomes one.  `none`: radians.
    """
    mean, d = vectors.mean(axis=0), vectors.shape[1]
    match scale:
        case "full":
            values, axes = np.linalg.eigh(np.cov(vectors, rowvar=False, bias=True).reshape(d, d))
            values = np.maximum(values, max(LEAST * float(values.max()), 1e-12))
            return mean, np.asarray(axes / np.sqrt(values) @ axes.T)
        case "diagonal":
            variances = vectors.var(axis=0)
            return mean, np.diag(1.0 / np.sqrt(np.maximum(variances, max(LEAST * float(variances.max()), 1e-12))))
        case "none":
            return mean, np.eye(d)


def whitened(codebook: Codebook, features: Floats) -> Floats:
    """(T, d) feature vectors in the codebook's coordinates."""
    brought: Floats = (features - codebook.mean) @ codebook.whitening
    return brought


def nearest(codewords: Floats, vectors: Floats) -> NDArray[np.int64]:
    """(T,) index of the codeword (k, d) that is nearest to each vector (T, d) in the codebook's coordinates."""
    found: NDArray[np.int64] = np.argmax(vectors @ codewords.T - 0.5 * np.sum(codewords**2, axis=1), axis=1)
    return found
