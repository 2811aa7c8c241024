"""Short gaps bridged, long ones named, another rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.recognizer.sequences import MAX_GAP_S, bridged, gaps_of, resampled


def ramp(count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.arange(count, dtype=np.float64)[:, None] * np.array([1.0, -2.0])


@given(st.integers(1, 6), st.integers(0, 13))
def test_a_short_gap_is_a_straight_line_and_at_an_end_held(length: int, first: int) -> None:
    features = ramp(20)
    features[first : first + length, 0] = np.nan
    found = bridged(features, length / MAX_GAP_S)
    expected = np.clip(np.arange(20.0), length if first == 0 else 0, None)
    np.testing.assert_allclose(found[:, 0], expected)
    rest = [k for k in range(20) if not first <= k < first + length]
    np.testing.assert_array_equal(found[rest], features[rest])


def test_a_long_gap_is_named_in_seconds() -> None:
    features = ramp(20)
    features[8:12] = np.inf
    with pytest.raises(ValueError, match=r"no angles from 3\.80 s to 4\.20 s: allowed: gaps of at most 0\.25 s"):
        bridged(features, 10.0, 3.0)


def test_gaps_are_runs_of_unknown_rows() -> None:
    assert gaps_of(np.array([False, True, False, False, True, False])) == [(0, 1), (2, 4), (5, 6)]


@pytest.mark.parametrize(
    ("rate", "wanted", "count"), [(30.0, 15.0, 8), (15.0, 15.0, 15), (10.0, 30.0, 43), (120.0, 15.0, 2)]
)
def test_another_rate_keeps_straight_lines_and_the_first_row(rate: float, wanted: float, count: int) -> None:
    found = resampled(ramp(15), rate, wanted)
    assert len(found) == count
    np.testing.assert_allclose(found[:, 0], np.arange(count) * rate / wanted, atol=1e-9)


def test_one_row_stays_one_row() -> None:
    np.testing.assert_array_equal(resampled(ramp(1), 30.0, 15.0), ramp(1))
