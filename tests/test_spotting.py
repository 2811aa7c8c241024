"""Spotting weighs every window exactly, and takes the ones that are worth most together."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from recognizer_cases import hidden, small_model

from services.recognizer.model import PostureModel, scores_of, symbols_of, whiten
from services.recognizer.spotting import (
    PRICE,
    Hypotheses,
    Spotting,
    Window,
    carried_on,
    hypotheses_of,
    in_order,
    settled,
    spotting_of,
)


def open_spotting(model: PostureModel) -> Spotting:
    """Without demands on scores and reach, so that many windows count."""
    return replace(spotting_of(model), thresholds=np.full(len(model.labels), -0.2), reach=np.zeros(len(model.labels)))


def carried(spotting: Spotting, features: np.ndarray) -> Hypotheses:
    hypotheses = hypotheses_of(spotting)
    for symbol, place in zip(symbols_of(spotting.model, features), whiten(spotting.model, features), strict=True):
        hypotheses = carried_on(spotting, hypotheses, int(symbol), place)
    return hypotheses


def ending(model: PostureModel, symbols: np.ndarray) -> np.ndarray:
    """(n,) log P(last state | symbols): the obvious forward pass."""
    alpha = model.start * model.emission[:, :, symbols[0]]
    for symbol in symbols[1:]:
        alpha /= alpha.sum(axis=1, keepdims=True)
        alpha = np.einsum("ni,nij->nj", alpha, model.transition) * model.emission[:, :, symbol]
    return np.asarray(np.log(alpha[:, -1] / alpha.sum(axis=1)))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_worth_is_that_of_the_best_windows_by_trying_all(seed: int) -> None:
    spotting = open_spotting(small_model())
    model = replace(spotting.model, transition=spotting.transition)
    features, _ = hidden(["right arm", "unknown"], [0.1, 0.0], seed)
    features = features[:60]
    symbols = symbols_of(model, features)
    worth = np.zeros(len(symbols) + 1)
    for end in range(1, len(symbols) + 1):
        worth[end] = worth[end - 1]
        for begin in range(max(0, end - spotting.window), end):
            rows = end - begin
            fits = (rows >= spotting.least) & (rows <= spotting.most)
            if not fits.any():
                continue
            window = symbols[begin:end]
            gains = rows * (scores_of(model, window) - spotting.thresholds) - PRICE + ending(model, window)
            worth[end] = max(worth[end], worth[begin] + gains[fits].max())
    assert worth[-1] > 0.0
    np.testing.assert_allclose(carried(spotting, features).worth[0], worth[-1], atol=1e-6)


def found(spotting: Spotting, features: np.ndarray, lag: int) -> list[tuple[Window, int]]:
    windows, hypotheses = [], hypotheses_of(spotting)
    for k, (symbol, place) in enumerate(
        zip(symbols_of(spotting.model, features), whiten(spotting.model, features), strict=True)
    ):
        hypotheses, window = settled(carried_on(spotting, hypotheses, int(symbol), place), lag)
        if window is not None:
            windows.append((window, k + 1))
    return windows


@pytest.mark.parametrize("seed", range(5))
def test_windows_never_overlap_and_are_told_no_earlier_than_the_lag(seed: int) -> None:
    features, _ = hidden(["kick", "left arm", "unknown", "kick"], [0.3, 0.1, 0.4, 0.0], seed)
    windows = found(open_spotting(small_model()), features, 5)
    assert len(windows) > 2
    for (one, _), (other, _) in pairwise(windows):
        assert one.end <= other.begin
    assert all(told - window.end >= 5 for window, told in windows)


def test_a_body_that_does_not_come_far_takes_no_posture() -> None:
    features, _ = hidden(["right arm"], [0.5])
    spotting = replace(open_spotting(small_model()), reach=np.full(4, 1e3))
    assert found(spotting, features, 5) == []


def test_nothing_is_changed_in_place() -> None:
    spotting = open_spotting(small_model())
    features, _ = hidden(["right arm"], [0.2])
    before = carried(spotting, features[:50])
    copy = {name: np.copy(value) for name, value in vars(before).items() if isinstance(value, np.ndarray)}
    carried_on(spotting, before, 3, features[50])
    settled(before, 1)
    for name, value in copy.items():
        np.testing.assert_array_equal(getattr(before, name), value)


def test_more_postures_and_shorter_ones_gain_more_by_their_order() -> None:
    model = small_model()
    assert (in_order(replace(model, durations=model.durations / 2)) > in_order(model)).all()


def test_standing_on_is_worth_nothing() -> None:
    """So a window ends with its posture, and is told soon, however few postures a model has."""
    features, truth = hidden(["squat"], [0.5])
    ((window, told),) = found(spotting_of(small_model()), np.concatenate([features, np.tile(features[-1], (60, 1))]), 5)
    assert window.end <= round(truth[0][2] * 15) + 3
    assert told <= round(truth[0][2] * 15) + 8
