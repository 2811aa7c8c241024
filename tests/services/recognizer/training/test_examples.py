"""Preparation of examples, and the errors of invalid ones."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.posture_cases import LABELS, examples, movement
from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.examples import (
    MAX_EXAMPLE_GAP_S,
    Example,
    TrainingSettings,
    fill_gaps,
    gaps,
    prepare,
    resample,
)


def example_with(**changes: object) -> Example:
    return replace(examples()[0], **changes)


def test_examples_are_resampled_to_the_rate_of_the_settings() -> None:
    ready = prepare([*examples(), *examples((8,), rate=60.0)], TrainingSettings(rate=30.0))
    seconds = [len(features) / 30.0 for features in ready.sequences]
    assert 1.7 < min(seconds) <= max(seconds) < 2.3
    assert ready.labels == LABELS


def test_short_gaps_are_interpolated_and_error_names_the_source_of_long_ones() -> None:
    features = movement("wave", 1, 0)
    features[5:8, 3] = np.nan
    assert np.isfinite(prepare([example_with(features=features)], TrainingSettings()).sequences[0]).all()
    features[5:12] = np.nan
    with pytest.raises(UserError, match=r"^m\.csv: line 4: a\.bvh: no angles from 0\.33 s to 0\.80 s: allowed: gaps"):
        prepare([example_with(features=features, source="m.csv: line 4: a.bvh")], TrainingSettings())


@pytest.mark.parametrize(
    ("before", "changes", "words"),
    [
        ([], {"label": ""}, "posture '': allowed: 1 to 64 printable characters"),
        ([], {"label": "x" * 65}, "allowed: 1 to 64 printable characters"),
        ([], {"label": "a\nb"}, r"posture 'a\\nb': allowed"),
        ([], {"features": np.zeros((0, 10))}, r"features of shape \(0, 10\): allowed: \(1 or more, 10\)"),
        ([], {"features": np.zeros((1, 10))}, "1 frames: allowed: 2 or more at 15/s"),
        ([], {"rate": float("nan")}, "rate = nan: allowed: more than 0"),
        ([], {"rate": 0.0}, "rate = 0.0: allowed: more than 0"),
        (examples(), {"features": np.zeros((9, 3))}, r"features of shape \(9, 3\): allowed: \(1 or more, 45\)"),
    ],
)
def test_error_names_the_invalid_value_of_an_example(before: list[Example], changes: dict[str, object], words: str) -> None:
    with pytest.raises(UserError, match=words):
        prepare([*before, example_with(**changes)], TrainingSettings())


@pytest.mark.nightly
def test_labels_may_be_any_text_and_are_limited_in_number() -> None:
    assert prepare([example_with(label="右手を上げる 🙋")], TrainingSettings()).labels == ("右手を上げる 🙋",)
    many = [example_with(label=str(k)) for k in range(257)]
    for found, words in ((many, "257 different postures: allowed: 256 at most"), ([], "no examples")):
        with pytest.raises(UserError, match=words):
            prepare(found, TrainingSettings())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"features": "knees"}, "features = 'knees': allowed: directions, joint-angles"),
        ({"topology": "ring"}, "topology = 'ring': allowed: left-right, ergodic"),
        ({"scale": "log"}, "scale = 'log': allowed: full, diagonal, none"),
        ({"symbols": 1}, "symbols = 1: allowed: 2 to 1024"),
        ({"states": 0}, "states = 0: allowed: 1 to 32"),
        ({"rate": float("nan")}, "rate = nan: allowed: 1 to 1000"),
        ({"floor": 0.0}, "floor = 0.0: allowed: 1e-06 to 0.5"),
    ],
)
def test_training_settings_out_of_range_are_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(UserError, match=words):
        replace(TrainingSettings(), **changes)


def ramp(count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.arange(count, dtype=np.float64)[:, None] * np.array([1.0, -2.0])


@given(st.integers(1, 6), st.integers(0, 13))
def test_a_short_gap_is_interpolated_linearly_or_held_at_an_end(length: int, first: int) -> None:
    features = ramp(20)
    features[first : first + length, 0] = np.nan
    found = fill_gaps(features, length / MAX_EXAMPLE_GAP_S)
    expected = np.clip(np.arange(20.0), length if first == 0 else 0, None)
    np.testing.assert_allclose(found[:, 0], expected)
    rest = [k for k in range(20) if not first <= k < first + length]
    np.testing.assert_array_equal(found[rest], features[rest])


def test_gaps_are_runs_of_unknown_rows() -> None:
    assert gaps(np.array([False, True, False, False, True, False])) == [(0, 1), (2, 4), (5, 6)]


@pytest.mark.parametrize(
    ("rows", "rate", "target_rate", "count"),
    [(15, 30.0, 15.0, 8), (15, 15.0, 15.0, 15), (15, 10.0, 30.0, 43), (15, 120.0, 15.0, 2), (1, 30.0, 15.0, 1)],
)
def test_resampling_keeps_straight_lines_and_the_first_row(rows: int, rate: float, target_rate: float, count: int) -> None:
    expected = np.arange(count)[:, None] * rate / target_rate * np.array([1.0, -2.0])
    np.testing.assert_allclose(resample(ramp(rows), rate, target_rate), expected, atol=1e-9)
