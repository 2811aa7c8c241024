"""Forward-backward pass against enumeration of all paths, and hmmlearn on a long sequence."""

from itertools import pairwise, product

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from zenocap.common.arrays import Floats
from zenocap.services.tracker.prior.forward_backward import Expectation, expectation


def chain(rng: np.random.Generator, states: int) -> Floats:
    return rng.dirichlet(np.ones(states), size=states)


def of_all_paths(transitions: Floats, log_densities: Floats) -> Expectation:
    """Every path with its probability, by definition."""
    frames, states = log_densities.shape
    paths = list(product(range(states), repeat=frames))
    logs = np.array([sum(log_densities[t, s] for t, s in enumerate(path)) for path in paths])
    logs += [sum(np.log(transitions[a, b]) for a, b in pairwise(path)) - np.log(states) for path in paths]
    total = logsumexp(logs)
    gamma, xi = np.zeros((frames, states)), np.zeros((states, states))
    for path, share in zip(paths, np.exp(logs - total), strict=True):
        for t, s in enumerate(path):
            gamma[t, s] += share
        for a, b in pairwise(path):
            xi[a, b] += share
    return Expectation(float(total), gamma, xi)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 6), st.sampled_from([3.0, 30.0, 400.0]))
@settings(max_examples=60)
def test_expectation_equals_enumeration_of_all_paths(seed: int, states: int, frames: int, scale: float) -> None:
    """Also where every density is far below the least number above zero."""
    rng = np.random.default_rng(seed)
    transitions, log_densities = chain(rng, states), rng.normal(scale=scale, size=(frames, states)) - 500.0
    found, expected = expectation(transitions, log_densities), of_all_paths(transitions, log_densities)
    assert found.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-9)
    assert np.allclose(found.gamma, expected.gamma, atol=1e-9)
    assert np.allclose(found.xi, expected.xi, atol=1e-9)


def test_expectation_equals_hmmlearn() -> None:
    rng = np.random.default_rng(0)
    model = GaussianHMM(n_components=4, covariance_type="full", init_params="")
    model.startprob_, model.transmat_ = np.full(4, 0.25), chain(rng, 4)
    model.means_, model.covars_ = rng.normal(size=(4, 3)), np.stack([np.eye(3) * s for s in (0.5, 1.0, 1.5, 2.0)])
    poses, _ = model.sample(300, random_state=1)
    densities = [multivariate_normal(*one).logpdf(poses) for one in zip(model.means_, model.covars_, strict=True)]
    found = expectation(model.transmat_, np.stack(densities, axis=1))
    assert found.log_likelihood == pytest.approx(model.score(poses), rel=1e-9)
    assert np.allclose(found.gamma, model.predict_proba(poses), atol=1e-9)


def test_error_names_the_unreachable_frame() -> None:
    never = np.array([[1.0, 0.0], [1.0, 0.0]])
    log_densities = np.array([[0.0, 0.0], [-np.inf, 0.0]])
    with pytest.raises(ValueError, match="frame 1: no state sequence"):
        expectation(never, log_densities)
