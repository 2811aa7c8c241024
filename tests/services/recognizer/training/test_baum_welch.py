"""Baum-Welch training of one posture, and smoothed emissions."""

import numpy as np
import pytest

from zenocap.common.arrays import Ints
from zenocap.services.recognizer.likelihood import forward_log_likelihoods
from zenocap.services.recognizer.training.baum_welch import smoothed, spread_of, train_hmm
from zenocap.services.recognizer.training.examples import TOPOLOGIES, Topology


def ascending_sequences(count: int = 8) -> list[Ints]:
    """Sequences from symbol 0 up to 4, all different."""
    rng = np.random.default_rng(2)
    return [np.repeat(np.arange(5), rng.integers(3, 7, 5)) for _ in range(count)]


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_probabilities_are_rows_that_sum_to_one(topology: Topology) -> None:
    hmm = train_hmm(ascending_sequences(), 6, 5, topology, 2, 0)
    for rows in (hmm.start, hmm.transition, hmm.emission):
        assert rows.min() >= 0.0
        np.testing.assert_allclose(rows.sum(axis=-1), 1.0, atol=1e-9)


def test_a_left_right_model_has_only_transitions_to_the_same_and_the_next_state() -> None:
    hmm = train_hmm(ascending_sequences(), 6, 5, "left-right", 1, 0)
    np.testing.assert_array_equal(np.triu(np.tril(hmm.transition, 1)), hmm.transition)
    assert list(hmm.emission.argmax(axis=1)) == [0, 1, 2, 3, 4]
    assert hmm.start[0] == 1.0


def test_the_fit_is_the_likelihood_of_the_examples() -> None:
    examples = ascending_sequences()
    hmm = train_hmm(examples, 6, 5, "ergodic", 1, 0)
    arrays = (hmm.start[None], hmm.transition[None], hmm.emission[None])
    total = sum(forward_log_likelihoods(*arrays, example)[0] for example in examples)
    assert hmm.fit == pytest.approx(total, rel=1e-6)


@pytest.mark.slow
def test_more_trials_never_lower_the_fit_and_equal_seeds_give_equal_bytes() -> None:
    fits = [train_hmm(ascending_sequences(), 6, 3, "ergodic", count, 7).fit for count in (1, 3, 6)]
    assert fits == sorted(fits)
    one, other = (train_hmm(ascending_sequences(), 6, 3, "ergodic", 3, 7) for _ in range(2))
    assert one.emission.tobytes() == other.emission.tobytes()


@pytest.mark.parametrize("states", [1, 3, 8])
def test_a_single_short_example_is_enough(states: int) -> None:
    hmm = train_hmm([np.array([2, 2, 0])], 4, states, "left-right", 1, 0)
    assert np.isfinite(hmm.emission).all()
    np.testing.assert_allclose(hmm.emission.sum(axis=1), 1.0)


def test_smoothing_weights_decrease_with_codeword_distance() -> None:
    spread = spread_of(np.array([[0.0], [1.0], [3.0]]), 1.0)
    np.testing.assert_allclose(spread.sum(axis=1), 1.0)
    assert spread[0, 0] > spread[0, 1] > spread[0, 2] > 0.0
    np.testing.assert_array_equal(spread_of(np.zeros((3, 2)), 0.0), np.eye(3))


def test_no_symbol_is_impossible_after_smoothing() -> None:
    emission = np.array([[1.0, 0.0, 0.0]])
    occurring = np.array([0.5, 0.3, 0.2])
    found = smoothed(emission, np.eye(3), 0.1, occurring)
    np.testing.assert_allclose(found, [[0.95, 0.03, 0.02]])
