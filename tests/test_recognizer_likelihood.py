"""The compiled forward algorithm against all paths, and the filler against a plain model of all its states."""

from itertools import product

import numpy as np
import pytest
from hmmlearn.hmm import CategoricalHMM
from hypothesis import given, settings
from hypothesis import strategies as st

from common.body.anatomy import Floats
from services.recognizer.likelihood import ANYTHING_STAYS, filler_log_likelihood, forward_log_likelihoods

seeds = st.integers(0, 10_000)


def rows(rng: np.random.Generator, *shape: int) -> Floats:
    return rng.dirichlet(np.ones(shape[-1]), shape[:-1])


def of_all_paths(start: Floats, transition: Floats, emission: Floats, symbols: Floats) -> float:
    total = 0.0
    for path in product(range(len(start)), repeat=len(symbols)):
        chance = start[path[0]] * emission[path[0], symbols[0]]
        for t in range(1, len(symbols)):
            chance *= transition[path[t - 1], path[t]] * emission[path[t], symbols[t]]
        total += chance
    return float(np.log(total))


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(1, 5))
def test_the_likelihood_is_the_sum_over_all_paths(seed: int, frames: int) -> None:
    rng = np.random.default_rng(seed)
    start, transition, emission = rows(rng, 2, 3), rows(rng, 2, 3, 3), rows(rng, 2, 3, 4)
    symbols = rng.integers(0, 4, frames)
    found = forward_log_likelihoods(start, transition, emission, symbols)
    for k in range(2):
        assert found[k] == pytest.approx(of_all_paths(start[k], transition[k], emission[k], symbols), rel=1e-12)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_likelihood_of_a_long_window_is_hmmlearns(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, transition, emission = rows(rng, 1, 5), rows(rng, 1, 5, 5), rows(rng, 1, 5, 64)
    symbols = rng.integers(0, 64, 400)
    hmm = CategoricalHMM(5, n_features=64)
    hmm.startprob_, hmm.transmat_, hmm.emissionprob_ = start[0], transition[0], emission[0]
    found = forward_log_likelihoods(start, transition, emission, symbols)[0]
    assert found == pytest.approx(hmm.score(symbols[:, None]), rel=1e-9)


def test_what_is_impossible_has_no_likelihood() -> None:
    start, transition = np.array([[1.0, 0.0]]), np.array([[[0.0, 1.0], [0.0, 1.0]]])
    emission = np.array([[[1.0, 0.0], [0.5, 0.5]]])
    assert forward_log_likelihoods(start, transition, emission, np.array([1, 1]))[0] == -np.inf
    assert forward_log_likelihoods(start, transition, emission, np.array([0, 1]))[0] == pytest.approx(np.log(0.5))


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(-1, 2), st.integers(1, 30))
def test_the_filler_is_a_model_of_all_states_each_reached_from_each(seed: int, without: int, frames: int) -> None:
    rng = np.random.default_rng(seed)
    staying, emission, anything = rng.uniform(0.1, 0.95, (3, 4)), rows(rng, 3, 4, 6), rows(rng, 6)
    symbols = rng.integers(0, 6, frames)
    kept = [k for k in range(3) if k != without]
    stay, count = np.append(staying[kept], ANYTHING_STAYS), 4 * len(kept) + 1
    states = np.concatenate([emission[kept].reshape(-1, 6), anything[None]])
    transition = np.tile(((1.0 - stay) / (count - 1))[:, None], (1, count))
    np.fill_diagonal(transition, stay)
    plain = forward_log_likelihoods(np.full((1, count), 1.0 / count), transition[None], states[None], symbols)
    assert filler_log_likelihood(staying, emission, anything, symbols, without) == pytest.approx(plain[0], rel=1e-9)


def test_a_filler_without_any_posture_is_how_often_symbols_occur() -> None:
    staying, emission, anything = np.full((1, 2), 0.5), np.full((1, 2, 3), 1 / 3), np.array([0.5, 0.3, 0.2])
    found = filler_log_likelihood(staying, emission, anything, np.array([0, 1]), 0)
    assert found == pytest.approx(np.log(0.5 * ANYTHING_STAYS * 0.3))
