"""Compiled forward algorithm and filler against plain models."""

from itertools import product

import numpy as np
import pytest
from hmmlearn.hmm import CategoricalHMM
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.common.arrays import Floats
from zenocap.services.recognizer.likelihood import FILLER_STAY, filler_log_likelihood, forward_log_likelihoods

seeds = st.integers(0, 10_000)


def stochastic(rng: np.random.Generator, *shape: int) -> Floats:
    return rng.dirichlet(np.ones(shape[-1]), shape[:-1])


def log_sum_over_paths(start: Floats, transition: Floats, emission: Floats, symbols: Floats) -> float:
    total = 0.0
    for path in product(range(len(start)), repeat=len(symbols)):
        probability = start[path[0]] * emission[path[0], symbols[0]]
        for t in range(1, len(symbols)):
            probability *= transition[path[t - 1], path[t]] * emission[path[t], symbols[t]]
        total += probability
    return float(np.log(total))


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(1, 5))
def test_the_likelihood_is_the_sum_over_all_paths(seed: int, frames: int) -> None:
    rng = np.random.default_rng(seed)
    start, transition, emission = stochastic(rng, 2, 3), stochastic(rng, 2, 3, 3), stochastic(rng, 2, 3, 4)
    symbols = rng.integers(0, 4, frames)
    found = forward_log_likelihoods(start, transition, emission, symbols)
    for k in range(2):
        assert found[k] == pytest.approx(log_sum_over_paths(start[k], transition[k], emission[k], symbols), rel=1e-12)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_likelihood_of_a_long_window_equals_that_of_hmmlearn(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, transition, emission = stochastic(rng, 1, 5), stochastic(rng, 1, 5, 5), stochastic(rng, 1, 5, 64)
    symbols = rng.integers(0, 64, 400)
    hmm = CategoricalHMM(5, n_features=64)
    hmm.startprob_, hmm.transmat_, hmm.emissionprob_ = start[0], transition[0], emission[0]
    found = forward_log_likelihoods(start, transition, emission, symbols)[0]
    assert found == pytest.approx(hmm.score(symbols[:, None]), rel=1e-9)


def test_an_impossible_sequence_has_zero_likelihood() -> None:
    start, transition = np.array([[1.0, 0.0]]), np.array([[[0.0, 1.0], [0.0, 1.0]]])
    emission = np.array([[[1.0, 0.0], [0.5, 0.5]]])
    assert forward_log_likelihoods(start, transition, emission, np.array([1, 1]))[0] == -np.inf
    assert forward_log_likelihoods(start, transition, emission, np.array([0, 1]))[0] == pytest.approx(np.log(0.5))


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(-1, 2), st.integers(1, 30))
def test_the_filler_equals_an_ergodic_model_of_all_states(seed: int, without: int, frames: int) -> None:
    rng = np.random.default_rng(seed)
    staying, emission, frequencies = rng.uniform(0.1, 0.95, (3, 4)), stochastic(rng, 3, 4, 6), stochastic(rng, 6)
    symbols = rng.integers(0, 6, frames)
    kept = [k for k in range(3) if k != without]
    stay, count = np.append(staying[kept], FILLER_STAY), 4 * len(kept) + 1
    states = np.concatenate([emission[kept].reshape(-1, 6), frequencies[None]])
    transition = np.tile(((1.0 - stay) / (count - 1))[:, None], (1, count))
    np.fill_diagonal(transition, stay)
    plain = forward_log_likelihoods(np.full((1, count), 1.0 / count), transition[None], states[None], symbols)
    assert filler_log_likelihood(staying, emission, frequencies, symbols, without) == pytest.approx(plain[0], rel=1e-9)


def test_a_filler_without_postures_uses_the_symbol_frequencies() -> None:
    staying, emission, frequencies = np.full((1, 2), 0.5), np.full((1, 2, 3), 1 / 3), np.array([0.5, 0.3, 0.2])
    found = filler_log_likelihood(staying, emission, frequencies, np.array([0, 1]), 0)
    assert found == pytest.approx(np.log(0.5 * FILLER_STAY * 0.3))
