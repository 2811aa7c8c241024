"""What a posture model says of a window."""

from dataclasses import replace

import numpy as np
import pytest

from services.recognizer.model import (
    distances_of,
    filler_likelihood,
    index_of,
    judge,
    log_likelihoods,
    scores_of,
    symbols_of,
    whiten,
)
from tests.posture_cases import LABELS, MOVED, movement, quick_model


@pytest.mark.parametrize("label", LABELS)
def test_a_person_never_seen_is_recognised(label: str) -> None:
    model = quick_model()
    found = judge(model, movement(label, 77, 0))
    assert model.labels[found.best] == label
    assert found.known
    assert found.margin > 0.0


def test_a_symbol_is_the_nearest_codeword_and_the_distance_that_to_it() -> None:
    model = quick_model()
    features = movement("bow", 5, 0)
    symbols = symbols_of(model, features)
    away = np.linalg.norm(whiten(model, features)[:, None] - model.codebook[None], axis=2)
    np.testing.assert_array_equal(symbols, away.argmin(axis=1))
    np.testing.assert_allclose(distances_of(model, features, symbols), away.min(axis=1))


def test_a_judgement_says_what_its_parts_say() -> None:
    model = quick_model()
    features = movement("wave", 6, 0)
    symbols, found = symbols_of(model, features), judge(model, features)
    np.testing.assert_array_equal(found.log_likelihoods, log_likelihoods(model, symbols))
    assert found.filler == filler_likelihood(model, symbols)
    np.testing.assert_allclose(found.scores, scores_of(model, symbols))
    assert found.margin == pytest.approx(np.diff(np.sort(found.log_likelihoods))[-1])
    assert found.distance == pytest.approx(distances_of(model, features, symbols).mean())


def test_below_its_threshold_or_far_from_everything_a_window_is_no_posture() -> None:
    model, features = quick_model(), movement("wave", 6, 0)
    score = judge(model, features).scores.max()
    assert judge(replace(model, thresholds=np.full(3, score - 1e-9)), features).known
    assert not judge(replace(model, thresholds=np.full(3, score + 1e-9)), features).known
    assert not judge(replace(model, farthest=1e-6), features).known


def test_postures_done_half_and_joined_are_better_explained_by_the_filler() -> None:
    model = quick_model()
    whole = judge(model, movement("wave", 9, 0))
    halves = np.concatenate([movement(label, 9, 0)[10:20] for label in ("wave", "kick", "bow", "kick")])
    assert judge(model, halves).scores.max() < whole.scores.max() - 0.1


def test_one_frame_has_likelihoods_too() -> None:
    model = quick_model()
    found = judge(model, movement("kick", 4, 0)[:1])
    assert np.isfinite(found.log_likelihoods).all()
    assert found.log_likelihoods.shape == (len(LABELS),)


def test_a_single_posture_has_no_margin() -> None:
    found = judge(quick_model(("kick",)), movement("kick", 4, 0))
    assert (found.best, found.margin) == (0, 0.0)


def test_a_posture_is_found_by_its_name_or_named() -> None:
    assert index_of(LABELS, "kick") == 1
    with pytest.raises(ValueError, match="posture 'jump': allowed: wave, kick, bow"):
        index_of(LABELS, "jump")


def test_the_last_state_of_a_chain_stays_in_the_filler_as_the_others_do() -> None:
    model = quick_model()
    own = np.diagonal(model.transition, axis1=1, axis2=2)
    assert (own[:, -1] > 1 - 1e-9).all()
    np.testing.assert_allclose(model.staying[:, -1], own[:, :-1].mean(axis=1))
    assert set(MOVED) > set(LABELS)
