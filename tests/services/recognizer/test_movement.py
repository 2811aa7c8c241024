"""Detection of movements, whether or not they are postures."""

import numpy as np
import pytest

from tests.support.recognizer_cases import RATE, small_model, standing, stream_with
from zenocap.services.recognizer.model import whiten
from zenocap.services.recognizer.movement import MovementState, RowRange, detect_movement


def movements(features: np.ndarray, longest: int = 200) -> list[RowRange]:
    model, moving, found = small_model(), MovementState(), []
    for number, row in enumerate(whiten(model, features)):
        moving, found_range = detect_movement(model, moving, row, number, longest)
        if found_range is not None:
            found.append(found_range)
    return found


@pytest.mark.parametrize("name", ["right arm", "left arm", "kick", "unknown"])
def test_a_movement_is_one_range_of_rows_at_its_time(name: str) -> None:
    features, truth = stream_with([name], [0.6])
    (found,) = movements(features)
    (_, begin_s, end_s) = truth[0]
    assert found.begin / RATE == pytest.approx(begin_s, abs=0.5)
    assert found.end / RATE == pytest.approx(end_s, abs=0.5)


def test_standing_still_is_no_movement() -> None:
    assert movements(standing(60.0, np.random.default_rng(3))) == []


def test_a_long_movement_is_reported_in_pieces_of_limited_length() -> None:
    time_s = np.arange(900) / RATE
    features = standing(60.0, np.random.default_rng(4)) + 1.5 * np.sin(3.0 * time_s)[:, None]
    found = movements(features, longest=90)
    assert len(found) > 5
    assert all(found_range.end - found_range.begin <= 90 for found_range in found)


def test_overlap_is_the_share_covered_by_other_ranges() -> None:
    assert RowRange(10, 20).overlap([RowRange(0, 12), RowRange(15, 18), RowRange(30, 40)]) == 0.5
    assert RowRange(10, 20).overlap([]) == 0.0
