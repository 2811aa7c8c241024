"""Proposals and distances, compiled, against plain numpy.  [Hybrid Eq. 24-28]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.prior_cases import D, drawn, known_prior, reconstruction_error
from zenocap.common.arrays import Floats
from zenocap.services.tracker.parameters import PRIOR_CLAMP
from zenocap.services.tracker.prior import model
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.prior.sampling import assign, prior_distance, propose

PRIOR = known_prior()
SEEDS = st.integers(0, 2**32 - 1)


def proposed(prior: Prior, region: int, pose: Floats, uniform: float, normals: Floats) -> tuple[int, Floats]:
    """Steps of [Hybrid V-A 3], one by one."""
    new = int(np.searchsorted(np.cumsum(prior.transitions[region])[:-1], uniform, side="right"))
    deviations = np.sqrt(prior.variances[new])
    z = model.project(prior, new, pose) + deviations * normals
    return new, model.reconstruct(prior, new, np.clip(z, -PRIOR_CLAMP * deviations, PRIOR_CLAMP * deviations))


@given(SEEDS, st.integers(0, 3), st.floats(0, 1, exclude_max=True), st.floats(0, 2))
def test_proposal_equals_the_plain_oracle(seed: int, region: int, uniform: float, spread: float) -> None:
    rng = np.random.default_rng(seed)
    pose, normals, out = rng.normal(scale=0.5, size=D), spread * rng.normal(size=3), np.empty(D)
    new = propose(PRIOR.compiled, region, pose, uniform, normals, out)
    expected, reconstructed = proposed(PRIOR, region, pose, uniform, normals)
    assert new == expected
    assert np.allclose(out, reconstructed, atol=1e-12)


@given(SEEDS, st.sampled_from([0.05, 0.5, 3.0]))
def test_assignment_and_distance_are_those_of_the_arrays(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    pose = PRIOR.centres[rng.integers(4)] + rng.normal(scale=spread, size=D)
    assert assign(PRIOR.compiled, pose) == model.assign(PRIOR, pose[None])[0]
    assert prior_distance(PRIOR.compiled, pose) == pytest.approx(reconstruction_error(PRIOR, pose[None]), rel=1e-6)


def test_training_poses_are_near() -> None:
    rng = np.random.default_rng(5)
    familiar, _ = drawn(PRIOR, 100, rng)
    unfamiliar = rng.normal(scale=0.5, size=(100, D))
    near, far = ([prior_distance(PRIOR.compiled, x) for x in poses] for poses in (familiar, unfamiliar))
    assert max(near) < min(far)
