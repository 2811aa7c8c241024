"""Scores of a window by a posture model."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.posture_cases import LABELS, MOVED, movement, quick_model
from zenocap.services.recognizer.model import classify, distances_of, filler_likelihood, log_likelihoods, symbols_of, whiten


@pytest.mark.parametrize("label", LABELS)
def test_a_posture_of_an_unseen_person_is_recognised(label: str) -> None:
    model = quick_model()
    found = classify(model, movement(label, 77, 0))
    assert model.labels[found.best] == label
    assert found.accepted
    assert found.margin > 0.0


def test_a_symbol_is_the_nearest_codeword_and_has_its_distance() -> None:
    model, features = quick_model(), movement("bow", 5, 0)
    symbols = symbols_of(model, features)
    away = np.linalg.norm(whiten(model, features)[:, None] - model.codebook[None], axis=2)
    np.testing.assert_array_equal(symbols, away.argmin(axis=1))
    np.testing.assert_allclose(distances_of(model, features, symbols), away.min(axis=1))


def test_a_classification_equals_its_separately_computed_scores() -> None:
    model, features = quick_model(), movement("wave", 6, 0)
    symbols, found = symbols_of(model, features), classify(model, features)
    np.testing.assert_array_equal(found.log_likelihoods, log_likelihoods(model, symbols))
    excess = log_likelihoods(model, symbols) - filler_likelihood(model, symbols)
    np.testing.assert_allclose(found.scores, excess / len(symbols))
    assert found.margin == pytest.approx(np.diff(np.sort(found.log_likelihoods))[-1] / len(symbols))
    assert found.distance == pytest.approx(distances_of(model, features, symbols).mean())


def test_a_window_below_the_threshold_or_far_from_the_codebook_is_rejected() -> None:
    model, features = quick_model(), movement("wave", 6, 0)
    score = classify(model, features).scores.max()
    assert classify(replace(model, thresholds=np.full(3, score - 1e-9)), features).accepted
    assert not classify(replace(model, thresholds=np.full(3, score + 1e-9)), features).accepted
    assert not classify(replace(model, farthest=1e-6), features).accepted


def test_joined_halves_of_postures_score_lower_than_a_whole_posture() -> None:
    model = quick_model()
    whole = classify(model, movement("wave", 9, 0))
    halves = np.concatenate([movement(label, 9, 0)[10:20] for label in ("wave", "kick", "bow", "kick")])
    assert classify(model, halves).scores.max() < whole.scores.max() - 0.1


def test_a_single_frame_has_likelihoods() -> None:
    found = classify(quick_model(), movement("kick", 4, 0)[:1])
    assert np.isfinite(found.log_likelihoods).all()
    assert found.log_likelihoods.shape == (len(LABELS),)


def test_a_single_posture_has_no_margin() -> None:
    found = classify(quick_model(("kick",)), movement("kick", 4, 0))
    assert (found.best, found.margin) == (0, 0.0)


def test_the_last_state_stays_in_the_filler_as_long_as_the_others() -> None:
    model = quick_model()
    own = np.diagonal(model.transition, axis1=1, axis2=2)
    assert (own[:, -1] > 1 - 1e-9).all()
    np.testing.assert_allclose(model.staying[:, -1], own[:, :-1].mean(axis=1))
    assert set(MOVED) > set(LABELS)
