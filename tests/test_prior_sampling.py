"""Proposals and distances, compiled, against plain numpy.  [Hybrid Eq. 24-28]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from common.body.anatomy import Floats
from services.tracker.prior import model
from services.tracker.prior.model import Prior
from services.tracker.prior.sampling import CLAMP, assign, distance, log_density, propose
from tests.prior_cases import D, drawn, known_prior

PRIOR = known_prior()
SEEDS = st.integers(0, 2**32 - 1)


def proposed(prior: Prior, region: int, pose: Floats, uniform: float, normals: Floats, scale: float) -> tuple[int, Floats]:
    """The steps of [Hybrid V-A 3], one by one."""
    new = int(np.searchsorted(np.cumsum(prior.transitions[region])[:-1], uniform, side="right"))
    deviations = np.sqrt(prior.variances[new])
    z = model.project(prior, new, pose) + np.sqrt(scale) * deviations * normals
    return new, model.reconstruct(prior, new, np.clip(z, -CLAMP * deviations, CLAMP * deviations))


@given(SEEDS, st.integers(0, 3), st.floats(0, 1, exclude_max=True), st.floats(0, 4))
def test_a_proposal_is_that_of_the_steps_one_by_one(seed: int, region: int, uniform: float, scale: float) -> None:
    rng = np.random.default_rng(seed)
    pose, normals, out = rng.normal(scale=0.5, size=D), rng.normal(size=3), np.empty(D)
    new = propose(PRIOR.tables, region, pose, uniform, normals, scale, out)
    expected, reconstructed = proposed(PRIOR, region, pose, uniform, normals, scale)
    assert new == expected
    assert np.allclose(out, reconstructed, atol=1e-12)


@given(SEEDS, st.integers(0, 3), st.floats(0, 1, exclude_max=True))
def test_a_proposal_lies_in_its_regions_clamped_subspace(seed: int, region: int, uniform: float) -> None:
    rng = np.random.default_rng(seed)
    out = np.empty(D)
    new = propose(PRIOR.tables, region, rng.normal(size=D), uniform, 5 * rng.normal(size=3), 1.0, out)
    assert np.allclose(model.reconstruct(PRIOR, new, model.project(PRIOR, new, out)), out, atol=1e-9)


def test_regions_follow_as_often_as_the_transitions_say() -> None:
    prior = known_prior(seed=3, stay=0.6)
    out, pose = np.empty(D), np.zeros(D)
    uniforms = (np.arange(1000) + 0.5) / 1000
    drawn_regions = [propose(prior.tables, 1, pose, u, np.zeros(3), 1.0, out) for u in uniforms]
    assert np.allclose(np.bincount(drawn_regions, minlength=4) / 1000, prior.transitions[1], atol=1e-3)


def test_samples_spread_as_lambda() -> None:
    """Around the centre, where the clamp takes little away."""
    rng = np.random.default_rng(4)
    prior = known_prior(stay=1.0)
    poses = np.empty((4000, D))
    for k in range(len(poses)):
        propose(prior.tables, 2, prior.centres[2], 0.5, rng.normal(size=3), 0.25, poses[k])
    z = (poses - prior.centres[2]) @ prior.bases[2]
    assert np.allclose(z.var(axis=0), 0.25 * prior.variances[2], rtol=0.1)


@given(SEEDS, st.sampled_from([0.05, 0.5, 3.0]))
def test_assignment_and_distance_are_those_of_the_arrays(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    pose = PRIOR.centres[rng.integers(4)] + rng.normal(scale=spread, size=D)
    assert assign(PRIOR.tables, pose) == model.assign(PRIOR, pose[None])[0]
    assert distance(PRIOR.tables, pose) == pytest.approx(model.reconstruction_error(PRIOR, pose[None]), rel=1e-6)


@given(SEEDS, st.sampled_from([0.02, 0.3, 2.0]))
def test_the_density_is_the_mixture_of_gaussians(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    pose = PRIOR.centres[rng.integers(4)] + rng.normal(scale=spread, size=D)
    logs = []
    for k in range(PRIOR.regions):
        basis = PRIOR.bases[k]
        covariance = basis @ np.diag(PRIOR.variances[k]) @ basis.T
        covariance += PRIOR.tables.spreads[k] * (np.eye(D) - basis @ basis.T)
        gaussian = multivariate_normal(PRIOR.centres[k], covariance)
        logs.append(np.log(PRIOR.occupancy[k]) + gaussian.logpdf(pose))
    assert log_density(PRIOR.tables, pose) == pytest.approx(logsumexp(logs), rel=1e-6, abs=1e-6)


def test_familiar_poses_are_near_and_dense_and_others_not() -> None:
    rng = np.random.default_rng(5)
    familiar, _ = drawn(PRIOR, 100, rng)
    strange = rng.normal(scale=0.5, size=(100, D))
    assert max(distance(PRIOR.tables, x) for x in familiar) < min(distance(PRIOR.tables, x) for x in strange)
    assert min(log_density(PRIOR.tables, x) for x in familiar) > max(log_density(PRIOR.tables, x) for x in strange)
