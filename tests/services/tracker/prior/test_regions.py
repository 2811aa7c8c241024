"""Distances and densities of the regions during training; `tests/test_papers.py` has their local PCA."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from tests.support.prior_cases import drawn, known_prior
from zenocap.common.arrays import Floats
from zenocap.services.tracker.prior import model
from zenocap.services.tracker.prior.regions import PriorRegions, distances_to, fit_regions, log_densities


def fitted(count: int, seed: int) -> tuple[Floats, PriorRegions]:
    """Poses drawn from the known prior, and their regions."""
    poses, labels = drawn(known_prior(), count, np.random.default_rng(seed))
    return poses, fit_regions(poses, labels, 4, 2, np.zeros(count))


@pytest.mark.slow
def test_regions_subspace_is_where_its_poses_vary_most() -> None:
    prior = known_prior(regions=1)
    poses, labels = drawn(prior, 3000, np.random.default_rng(0))
    regions = fit_regions(poses, labels, 1, 4, np.zeros(len(poses)))
    assert np.allclose(regions.centres, prior.centres, atol=0.03)
    assert np.allclose(regions.spectrum[0, :3], prior.variances[0], rtol=0.15)
    shared = np.linalg.svd(regions.vectors[0][:, :3].T @ prior.bases[0])[1]
    assert np.all(shared > 0.99)


def test_distances_are_the_finished_priors() -> None:
    poses, regions = fitted(200, 2)
    prior = known_prior()
    prior.centres[:], prior.bases[:] = regions.centres, regions.vectors[:, :, :3]
    prior.variances[:] = regions.spectrum[:, :3]
    assert np.allclose(distances_to(regions, poses, 3)[0], model.distances(prior, poses), atol=1e-9)


def test_densities_are_gaussian() -> None:
    poses, regions = fitted(300, 3)
    for k in range(4):
        covariance = regions.vectors[k] @ np.diag(regions.spectrum[k]) @ regions.vectors[k].T
        expected = multivariate_normal(regions.centres[k], covariance).logpdf(poses[:20])
        assert np.allclose(log_densities(regions, poses[:20])[:, k], expected)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1))
def test_regions_without_poses_restart_at_great_distances(seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses, labels = drawn(known_prior(), 60, rng)
    assume(np.count_nonzero(labels == 1) >= 3)  # with fewer poses than `least`, region 1 restarts too, before region 2
    distances = rng.random(60)
    regions = fit_regions(poses, np.where(labels > 1, 0, labels), 4, 3, distances)
    assert np.array_equal(regions.centres[2], poses[np.argmax(distances)])
    assert not np.array_equal(regions.centres[2], regions.centres[3])
    assert any(np.array_equal(regions.centres[3], pose) for pose in poses)
