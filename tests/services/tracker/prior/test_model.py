"""Projection, reconstruction and assignment.  [Hybrid Eq. 8-10, 18, 19]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.prior_cases import D, drawn, known_prior, reconstruction_error
from zenocap.services.tracker.parameters import PRIOR_CENTRE_WEIGHT, PRIOR_CLAMP
from zenocap.services.tracker.prior import model
from zenocap.services.tracker.prior.resampling import at_rate

SEEDS = st.integers(0, 2**32 - 1)
REGIONS = st.integers(0, 3)


@given(SEEDS, REGIONS)
def test_projection_inverts_reconstruction(seed: int, region: int) -> None:
    prior = known_prior()
    limit = PRIOR_CLAMP * np.sqrt(prior.variances[region])
    z = np.random.default_rng(seed).uniform(-limit, limit)
    assert np.allclose(model.project(prior, region, model.reconstruct(prior, region, z)), z, atol=1e-12)


@given(SEEDS, REGIONS)
def test_reconstruction_is_the_nearest_clamped_point(seed: int, region: int) -> None:
    prior, rng = known_prior(), np.random.default_rng(seed)
    pose = rng.normal(scale=2.0, size=D)
    limit = PRIOR_CLAMP * np.sqrt(prior.variances[region])
    nearest = np.linalg.norm(pose - model.reconstruct(prior, region, model.project(prior, region, pose)))
    others = model.reconstruct(prior, region, rng.uniform(-limit, limit, (50, prior.dimensions)))
    assert np.all(np.linalg.norm(pose - others, axis=1) >= nearest - 1e-9)


@given(SEEDS, REGIONS)
def test_eq_9_is_eq_10_where_nothing_is_clamped(seed: int, region: int) -> None:
    """The trailing directions' quadratic form, and the centre term beside it."""
    prior, rng = known_prior(), np.random.default_rng(seed)
    basis = prior.bases[region]
    trailing = np.linalg.svd(basis)[0][:, prior.dimensions :]
    z = rng.uniform(-1, 1, prior.dimensions) * np.sqrt(prior.variances[region])
    pose = prior.centres[region] + basis @ z + trailing @ rng.normal(scale=0.1, size=D - prior.dimensions)
    from_centre = pose - prior.centres[region]
    expected = from_centre @ trailing @ trailing.T @ from_centre + PRIOR_CENTRE_WEIGHT * np.sum(z**2)
    assert model.distances(prior, pose[None])[0, region] == pytest.approx(expected)


def test_poses_belong_to_the_regions_they_were_drawn_from() -> None:
    prior = known_prior()
    poses, regions = drawn(prior, 400, np.random.default_rng(1))
    assert np.mean(model.assign(prior, poses) == regions) > 0.98


def test_centre_term_rejects_poses_far_along_a_subspace() -> None:
    """Eq. 9 as printed gives such a pose a distance of zero."""
    prior = known_prior()
    far = prior.centres[0] + 5.0 * prior.bases[0][:, 0]
    assert model.distances(prior, far[None])[0, 0] > 1.0


def test_error_of_drawn_poses_is_the_noise_off_the_subspaces() -> None:
    prior = known_prior()
    poses, _ = drawn(prior, 2000, np.random.default_rng(2))
    off = np.sqrt((D - prior.dimensions) / D) * np.radians(0.5)
    assert reconstruction_error(prior, poses) == pytest.approx(off, rel=0.3)
    assert model.reconstruct_poses(prior, poses).shape == poses.shape


def test_rate_changes_only_the_transitions() -> None:
    prior = known_prior()
    half = at_rate(prior, 30.0)
    assert half.rate == 30.0
    assert half.centres is prior.centres
    assert np.allclose(half.transitions, prior.transitions @ prior.transitions)
    assert at_rate(prior, 1e9 / 16_666_667) is prior
    assert at_rate(prior, 30.0) is half
    assert np.array_equal(at_rate(prior, 1e9 / 33_333_333).transitions, half.transitions)


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_invalid_rate_is_refused(rate: float) -> None:
    with pytest.raises(ValueError, match=r"rate = .*: allowed: a positive"):
        at_rate(known_prior(), rate)
