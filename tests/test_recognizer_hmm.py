"""Baum-Welch of one posture, and emissions that expect what the examples did not show."""

import numpy as np
import pytest

from services.recognizer.examples import TOPOLOGIES, Topology
from services.recognizer.hmm import Symbols, learnt, smoothed, spread_of
from services.recognizer.likelihood import forward_log_likelihoods


def stairs(count: int = 8) -> list[Symbols]:
    """Sequences that climb from symbol 0 to 4, never two alike."""
    rng = np.random.default_rng(2)
    return [np.repeat(np.arange(5), rng.integers(3, 7, 5)) for _ in range(count)]


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_probabilities_are_rows_that_sum_to_one(topology: Topology) -> None:
    hmm = learnt(stairs(), 6, 5, topology, 2, 0)
    for rows in (hmm.start, hmm.transition, hmm.emission):
        assert rows.min() >= 0.0
        np.testing.assert_allclose(rows.sum(axis=-1), 1.0, atol=1e-9)


def test_states_of_a_left_right_model_follow_on_each_other() -> None:
    hmm = learnt(stairs(), 6, 5, "left-right", 1, 0)
    np.testing.assert_array_equal(np.triu(np.tril(hmm.transition, 1)), hmm.transition)
    assert list(hmm.emission.argmax(axis=1)) == [0, 1, 2, 3, 4]
    assert hmm.start[0] == 1.0


def test_its_fit_is_the_likelihood_of_the_examples() -> None:
    examples = stairs()
    hmm = learnt(examples, 6, 5, "ergodic", 1, 0)
    arrays = (hmm.start[None], hmm.transition[None], hmm.emission[None])
    total = sum(forward_log_likelihoods(*arrays, example)[0] for example in examples)
    assert hmm.fit == pytest.approx(total, rel=1e-6)


def test_more_trials_never_fit_worse_and_the_seed_decides_the_bits() -> None:
    fits = [learnt(stairs(), 6, 3, "ergodic", count, 7).fit for count in (1, 3, 6)]
    assert fits == sorted(fits)
    one, other = (learnt(stairs(), 6, 3, "ergodic", 3, 7) for _ in range(2))
    assert one.emission.tobytes() == other.emission.tobytes()


@pytest.mark.parametrize("states", [1, 3, 8])
def test_a_single_short_example_is_enough(states: int) -> None:
    hmm = learnt([np.array([2, 2, 0])], 4, states, "left-right", 1, 0)
    assert np.isfinite(hmm.emission).all()
    np.testing.assert_allclose(hmm.emission.sum(axis=1), 1.0)


def test_a_symbol_stands_most_for_itself_and_more_for_the_nearer() -> None:
    spread = spread_of(np.array([[0.0], [1.0], [3.0]]), 1.0)
    np.testing.assert_allclose(spread.sum(axis=1), 1.0)
    assert spread[0, 0] > spread[0, 1] > spread[0, 2] > 0.0
    np.testing.assert_array_equal(spread_of(np.zeros((3, 2)), 0.0), np.eye(3))


def test_no_symbol_is_impossible_after_smoothing() -> None:
    emission = np.array([[1.0, 0.0, 0.0]])
    occurring = np.array([0.5, 0.3, 0.2])
    found = smoothed(emission, np.eye(3), 0.1, occurring)
    np.testing.assert_allclose(found, [[0.95, 0.03, 0.02]])
