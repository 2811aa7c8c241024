"""Normalization of features, and nearest codewords."""

import numpy as np
import pytest

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.training.codebook import nearest, standardisation, train_codebook, whitened


def cloud(seed: int = 1, count: int = 400) -> Floats:
    """Correlated vectors (count, 4)."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 4)) @ (np.eye(4) + 0.3 * rng.normal(size=(4, 4))) + 3.0


def test_full_whitening_gives_an_identity_covariance() -> None:
    vectors = cloud()
    mean, whitening = standardisation(vectors, "full")
    points = (vectors - mean) @ whitening
    np.testing.assert_allclose(np.cov(points, rowvar=False, bias=True), np.eye(4), atol=1e-9)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=1e-9)


def test_diagonal_scaling_gives_unit_variances_on_the_same_axes() -> None:
    mean, whitening = standardisation(cloud(), "diagonal")
    np.testing.assert_allclose(((cloud() - mean) @ whitening).std(axis=0), 1.0)
    np.testing.assert_array_equal(whitening, np.diag(np.diag(whitening)))


def test_without_scale_distances_stay_radians() -> None:
    mean, whitening = standardisation(cloud(), "none")
    np.testing.assert_array_equal(whitening, np.eye(4))
    np.testing.assert_allclose(mean, cloud().mean(axis=0))


@pytest.mark.parametrize("scale", ["full", "diagonal"])
def test_a_constant_feature_is_not_amplified(scale: str) -> None:
    vectors = np.column_stack([cloud(), np.full(400, 0.7)])
    _, whitening = standardisation(vectors, scale)
    assert np.isfinite(whitening).all()
    assert np.abs(whitening).max() < 1e3


def test_the_nearest_codeword_is_the_nearest_of_all() -> None:
    rng = np.random.default_rng(5)
    codewords, vectors = rng.normal(size=(16, 4)), rng.normal(size=(100, 4))
    distances = np.linalg.norm(vectors[:, None] - codewords[None], axis=2)
    np.testing.assert_array_equal(nearest(codewords, vectors), distances.argmin(axis=1))


def test_codewords_are_the_means_of_their_vectors() -> None:
    book = train_codebook([cloud(1), cloud(2)], 12, "full", 0)
    points = whitened(book, np.concatenate([cloud(1), cloud(2)]))
    symbols = nearest(book.codewords, points)
    assert set(symbols) == set(range(12))
    for k in range(12):
        np.testing.assert_allclose(points[symbols == k].mean(axis=0), book.codewords[k], atol=0.02)


def test_equal_seeds_give_equal_codebook_bytes() -> None:
    one, other = (train_codebook([cloud()], 12, "full", 3) for _ in range(2))
    assert one.codewords.tobytes() == other.codewords.tobytes()
    assert one.codewords.tobytes() != train_codebook([cloud()], 12, "full", 4).codewords.tobytes()


def test_few_different_vectors_make_few_codewords() -> None:
    vectors = np.repeat(cloud(1, 5), 10, axis=0)
    assert len(train_codebook([vectors], 64, "diagonal", 0).codewords) == 5
