"""Codebook: whitening of feature vectors and k-means.  [Two-view 5.1]"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits

from zenocap.common.arrays import Floats, Ints
from zenocap.services.recognizer.training.examples import Scale
from zenocap.services.recognizer.training.parameters import KMEANS_RESTARTS, LEAST_VARIANCE, VECTOR_DIGITS


@dataclass(frozen=True)
class Codebook:
    """Whitening and codewords.

    mean: (d,), whitening: (d, d), codewords: (k, d): the whitened vector f is (f - mean) @ whitening.
    """

    mean: Floats
    whitening: Floats
    codewords: Floats


def train_codebook(sequences: Sequence[Floats], symbols: int, scale: Scale, seed: int) -> Codebook:
    """Codebook of sequences (T_i, d): `symbols` codewords, at most the number of different vectors.

    Equal sequences and seeds give equal codebooks: k-means runs on one thread.
    """
    vectors = np.concatenate(sequences)
    mean, whitening = standardisation(vectors, scale)
    points = (vectors - mean) @ whitening
    count = min(symbols, len(np.unique(points.round(VECTOR_DIGITS), axis=0)))
    # Paper (open): 5.1 does not define how vectors become symbols; here k-means.
    with threadpool_limits(limits=1):
        found = KMeans(n_clusters=count, n_init=KMEANS_RESTARTS, random_state=seed, algorithm="lloyd").fit(points)
    return Codebook(mean, whitening, np.ascontiguousarray(found.cluster_centers_, dtype=np.float64))


def standardisation(vectors: Floats, scale: Scale) -> tuple[Floats, Floats]:
    """(d,) mean and (d, d) whitening of vectors (n, d).

    `full`: covariance becomes the identity.  `diagonal`: every feature's variance becomes 1.  `none`: radians.
    """
    mean, d = vectors.mean(axis=0), vectors.shape[1]
    match scale:
        case "full":
            values, axes = np.linalg.eigh(np.cov(vectors, rowvar=False, bias=True).reshape(d, d))
            values = np.maximum(values, max(LEAST_VARIANCE * float(values.max()), 1e-12))
            return mean, np.asarray(axes / np.sqrt(values) @ axes.T)
        case "diagonal":
            variances = vectors.var(axis=0)
            return mean, np.diag(1.0 / np.sqrt(np.maximum(variances, max(LEAST_VARIANCE * float(variances.max()), 1e-12))))
        case "none":
            return mean, np.eye(d)


def whitened(codebook: Codebook, features: Floats) -> Floats:
    """(T, d) whitened feature vectors."""
    result: Floats = (features - codebook.mean) @ codebook.whitening
    return result


def nearest(codewords: Floats, vectors: Floats) -> Ints:
    """(T,) index of the nearest codeword (k, d) of each whitened vector (T, d)."""
    found: Ints = np.argmax(vectors @ codewords.T - 0.5 * np.sum(codewords**2, axis=1), axis=1)
    return found
