"""Transitions at other frame rates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from tests.support.prior_cases import known_prior
from zenocap.common.arrays import Floats
from zenocap.services.tracker.prior.resampling import power_of_transitions, stochastic


def chain(seed: int, states: int) -> Floats:
    """Any chain, some transitions impossible."""
    rng = np.random.default_rng(seed)
    entries = rng.random((states, states)) * (rng.random((states, states)) < 0.6) + np.eye(states) * 0.1
    return entries / entries.sum(axis=1, keepdims=True)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.floats(0.05, 8.0))
def test_powers_of_transitions_are_stochastic(seed: int, states: int, exponent: float) -> None:
    power = power_of_transitions(chain(seed, states), exponent)
    assert power.min() >= 0
    assert np.allclose(power.sum(axis=1), 1.0, atol=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_whole_powers_equal_repeated_steps(seed: int, steps: int) -> None:
    transitions = chain(seed, 6)
    assert np.allclose(power_of_transitions(transitions, steps), np.linalg.matrix_power(transitions, steps))


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3.0))
def test_root_of_a_continuous_time_chain_is_exact(seed: int, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    generator = rng.uniform(0.01, 0.3, (5, 5))
    np.fill_diagonal(generator, 0.0)
    np.fill_diagonal(generator, -generator.sum(axis=1))
    assert np.allclose(power_of_transitions(expm(generator), exponent), expm(exponent * generator), atol=1e-6)


def test_chain_without_root_is_interpolated() -> None:
    """Two regions that always alternate have no half step."""
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])
    assert np.allclose(power_of_transitions(swap, 0.5), 0.5)


@pytest.mark.parametrize("exponent", [0.5, 1.5, 2.4])
def test_stationary_distribution_is_kept_at_every_rate(exponent: float) -> None:
    transitions = known_prior(stay=0.7).transitions
    power = power_of_transitions(transitions, exponent)
    assert np.allclose(np.linalg.matrix_power(power, 500), np.linalg.matrix_power(transitions, 500), atol=1e-3)


def test_zero_row_becomes_uniform() -> None:
    assert np.allclose(stochastic(np.array([[0.0, 0.0], [-0.1, 2.0]])), [[0.5, 0.5], [0.0, 1.0]])
