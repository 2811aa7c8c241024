"""Expectation-maximization on motion of known regions, and its properties.  [Hybrid IV]"""

from itertools import permutations

import numpy as np
import pytest

from tests.support.prior_cases import D, drawn, gait, known_prior
from zenocap.services.tracker.parameters import EM_TOLERANCE
from zenocap.services.tracker.prior.learning import error_of, learn, reestimate_transitions


@pytest.mark.slow
def test_training_recovers_known_regions_subspaces_and_transitions() -> None:
    prior = known_prior(seed=7)
    poses, _ = drawn(prior, 4000, np.random.default_rng(0))
    learnt = learn([poses], 4, 3, np.random.default_rng(1))
    offsets = np.linalg.norm(learnt.regions.centres[:, None] - prior.centres[None], axis=2)
    order = min(permutations(range(4)), key=lambda some: sum(offsets[some[k], k] for k in range(4)))
    take = list(order)
    assert np.all(offsets[take, range(4)] < 0.1)
    assert np.allclose(learnt.transitions[np.ix_(take, take)], prior.transitions, atol=0.04)
    for k, region in enumerate(take):
        shared = np.linalg.svd(learnt.regions.vectors[region][:, :3].T @ prior.bases[k])[1]
        assert np.all(shared > 0.98)


@pytest.mark.slow
def test_more_regions_reconstruct_training_motion_better() -> None:
    """The paper's Fig. 4."""
    sequences = [gait(300, seed) for seed in range(3)]
    errors = [learn(sequences, count, 2, np.random.default_rng(0)).errors[-1] for count in (1, 3, 8, 20)]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.25 * errors[0]


def test_training_ends_when_the_error_converges() -> None:
    learnt = learn([gait(400)], 6, 3, np.random.default_rng(0))
    assert abs(learnt.errors[-2] - learnt.errors[-1]) < EM_TOLERANCE * learnt.errors[-2]
    assert error_of(learnt.regions, gait(400), 3) == pytest.approx(learnt.errors[-1])


def test_sequences_are_not_joined() -> None:
    """Two poses that never follow each other, in two sequences."""
    rng = np.random.default_rng(0)
    apart = [centre + rng.normal(scale=0.01, size=(60, D)) for centre in (np.zeros(D), np.ones(D))]
    cut = learn(apart, 2, 1, np.random.default_rng(0))
    joined = learn([np.concatenate(apart)], 2, 1, np.random.default_rng(0))
    first, second = int(cut.labels[0]), int(cut.labels[-1])
    assert first != second
    assert cut.transitions[first, second] == pytest.approx(0.5 / 60)  # half of the pseudo-count of one frame
    assert joined.transitions[joined.labels[0], joined.labels[-1]] == pytest.approx(1.5 / 61)


def test_expectation_never_lowers_the_likelihood_of_the_transitions() -> None:
    prior = known_prior()
    sequences = [drawn(prior, 150, np.random.default_rng(k))[0] for k in range(3)]
    regions = learn(sequences, 4, 3, np.random.default_rng(0)).regions
    transitions = np.full((4, 4), 0.25)
    likelihoods = []
    for _ in range(8):
        transitions, likelihood = reestimate_transitions(sequences, regions, transitions)
        likelihoods.append(likelihood)
    assert likelihoods[1] > likelihoods[0] + 100
    assert np.all(np.diff(likelihoods) > -0.5)  # the pseudo-counts may lower it slightly


def test_every_region_keeps_poses_and_every_row_is_stochastic() -> None:
    """More regions are requested than the motion fills."""
    still = np.repeat(gait(6), 10, axis=0)
    learnt = learn([still], 12, 3, np.random.default_rng(0))
    assert np.all(np.bincount(learnt.labels) >= 4)
    assert len(learnt.regions.centres) == len(learnt.transitions) == len(np.bincount(learnt.labels)) <= 12
    assert np.allclose(learnt.transitions.sum(axis=1), 1.0)
    assert learnt.transitions.min() > 0


def test_same_seed_gives_the_same_bytes() -> None:
    one, other = (learn([gait(200)], 8, 3, np.random.default_rng(5)) for _ in range(2))
    assert one.transitions.tobytes() == other.transitions.tobytes()
    assert one.regions.vectors.tobytes() == other.regions.vectors.tobytes()
