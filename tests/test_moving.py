"""Movements are found whatever they are, and standing is none."""

import numpy as np
import pytest
from recognizer_cases import RATE, hidden, small_model, still

from services.recognizer.model import whiten
from services.recognizer.moving import Moving, Stretch, moved


def stretches(features: np.ndarray, longest: int = 200) -> list[Stretch]:
    model, moving, found = small_model(), Moving(), []
    for number, row in enumerate(whiten(model, features)):
        moving, stretch = moved(model, moving, row, number, longest)
        if stretch is not None:
            found.append(stretch)
    return found


@pytest.mark.parametrize("name", ["right arm", "left arm", "kick", "unknown"])
def test_one_movement_is_one_stretch_about_where_it_is(name: str) -> None:
    features, truth = hidden([name], [0.6])
    (found,) = stretches(features)
    (_, begin_s, end_s) = truth[0]
    assert found.begin / RATE == pytest.approx(begin_s, abs=0.5)
    assert found.end / RATE == pytest.approx(end_s, abs=0.5)


def test_standing_is_no_movement() -> None:
    assert stretches(still(60.0, np.random.default_rng(3))) == []


def test_a_movement_without_end_is_told_in_pieces() -> None:
    time_s = np.arange(900) / RATE
    features = still(60.0, np.random.default_rng(4)) + 1.5 * np.sin(3.0 * time_s)[:, None]
    found = stretches(features, longest=90)
    assert len(found) > 5
    assert all(stretch.end - stretch.begin <= 90 for stretch in found)


def test_the_share_that_others_cover() -> None:
    assert Stretch(10, 20).covered([Stretch(0, 12), Stretch(15, 18), Stretch(30, 40)]) == 0.5
    assert Stretch(10, 20).covered([]) == 0.0
