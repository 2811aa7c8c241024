"""Segmentation: exact scores of all windows, the best sequence of windows, delay."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.support.recognizer_cases import small_model, stream_with
from zenocap.services.recognizer.model import PostureModel, filler_likelihood, log_likelihoods, symbols_of, whiten
from zenocap.services.recognizer.parameters import WINDOW_PRICE
from zenocap.services.recognizer.segmentation import (
    Hypotheses,
    SegmentationSetup,
    Window,
    advance,
    expected_gain,
    initial_hypotheses,
    pop_window,
    segmentation_setup,
)


def permissive_setup(model: PostureModel) -> SegmentationSetup:
    """Low thresholds and no minimum extent, so that many windows have a positive gain."""
    setup, n = segmentation_setup(model), len(model.labels)
    return replace(setup, arrays=setup.arrays._replace(thresholds=np.full(n, -0.2), reach=np.zeros(n)))


def advanced(setup: SegmentationSetup, features: np.ndarray) -> Hypotheses:
    hypotheses = initial_hypotheses(setup)
    for symbol, place in zip(symbols_of(setup.model, features), whiten(setup.model, features), strict=True):
        hypotheses = advance(setup, hypotheses, int(symbol), place)
    return hypotheses


def log_last_state(model: PostureModel, symbols: np.ndarray) -> np.ndarray:
    """(n,) log P(last state | symbols), by a direct forward pass."""
    alpha = model.start * model.emission[:, :, symbols[0]]
    for symbol in symbols[1:]:
        alpha /= alpha.sum(axis=1, keepdims=True)
        alpha = np.einsum("ni,nij->nj", alpha, model.transition) * model.emission[:, :, symbol]
    return np.asarray(np.log(alpha[:, -1] / alpha.sum(axis=1)))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_gain_equals_that_of_the_best_windows_by_exhaustive_search(seed: int) -> None:
    setup = permissive_setup(small_model())
    model = replace(setup.model, transition=setup.arrays.transition)
    features, _ = stream_with(["right arm", "unknown"], [0.1, 0.0], seed)
    features = features[:60]
    symbols = symbols_of(model, features)
    gain = np.zeros(len(symbols) + 1)
    for end in range(1, len(symbols) + 1):
        gain[end] = gain[end - 1]
        for begin in range(max(0, end - setup.window), end):
            rows = end - begin
            fits = (rows >= setup.arrays.shortest) & (rows <= setup.arrays.longest)
            if not fits.any():
                continue
            window = symbols[begin:end]
            excess = log_likelihoods(model, window) - filler_likelihood(model, window)
            gains = excess - rows * setup.arrays.thresholds - WINDOW_PRICE + log_last_state(model, window)
            gain[end] = max(gain[end], gain[begin] + gains[fits].max())
    assert gain[-1] > 0.0
    np.testing.assert_allclose(advanced(setup, features).windows.gain[0], gain[-1], atol=1e-6)


def found(setup: SegmentationSetup, features: np.ndarray, delay: int) -> list[tuple[Window, int]]:
    windows, hypotheses = [], initial_hypotheses(setup)
    for k, (symbol, place) in enumerate(zip(symbols_of(setup.model, features), whiten(setup.model, features), strict=True)):
        hypotheses, window = pop_window(advance(setup, hypotheses, int(symbol), place), delay)
        if window is not None:
            windows.append((window, k + 1))
    return windows


@pytest.mark.parametrize("seed", range(5))
def test_windows_do_not_overlap_and_are_reported_after_the_delay(seed: int) -> None:
    features, _ = stream_with(["kick", "left arm", "unknown", "kick"], [0.3, 0.1, 0.4, 0.0], seed)
    windows = found(permissive_setup(small_model()), features, 5)
    assert len(windows) > 2
    for (one, _), (other, _) in pairwise(windows):
        assert one.end <= other.begin
    assert all(reported - window.end >= 5 for window, reported in windows)


def test_windows_below_the_least_reach_are_not_postures() -> None:
    features, _ = stream_with(["right arm"], [0.5])
    setup = permissive_setup(small_model())
    setup = replace(setup, arrays=setup.arrays._replace(reach=np.full(4, 1e3)))
    assert found(setup, features, 5) == []


def test_a_step_does_not_modify_its_argument() -> None:
    setup = permissive_setup(small_model())
    features, _ = stream_with(["right arm"], [0.2])
    before = advanced(setup, features[:50])
    copies = [value.copy() for value in (*before.windows, before.origin)]
    advance(setup, before, 3, features[50])
    pop_window(before, 1)
    for value, copy in zip((*before.windows, before.origin), copies, strict=True):
        np.testing.assert_array_equal(value, copy)


def test_shorter_postures_have_a_larger_expected_gain_per_frame() -> None:
    model = small_model()
    assert (expected_gain(replace(model, durations=model.durations / 2)) > expected_gain(model)).all()


def test_standing_still_after_a_posture_gains_nothing() -> None:
    """So a window ends with its posture and is reported soon, even with few postures in the model."""
    features, truth = stream_with(["squat"], [0.5])
    still = np.tile(features[-1], (60, 1))
    ((window, reported),) = found(segmentation_setup(small_model()), np.concatenate([features, still]), 5)
    assert window.end <= round(truth[0][2] * 15) + 3
    assert reported <= round(truth[0][2] * 15) + 8
