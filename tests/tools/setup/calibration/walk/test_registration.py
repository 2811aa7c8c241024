"""Ways of one person as several cameras see them: turned and shifted, mirrored, unrelated."""

import numpy as np
import pytest

from tests.support.upright import figure
from zenocap.tools.setup.calibration.walk.registration import joined, pairs_of, registered

PATH = figure()[:, 0] + 1j * figure()[:, 1]
TURN, SHIFT = np.exp(0.7j), 2.0 - 3.0j


def noisy(seed, share=0.0):
    rng = np.random.default_rng(seed)
    track = PATH + 0.05 * (rng.normal(size=len(PATH)) + 1j * rng.normal(size=len(PATH)))
    wrong = rng.random(len(PATH)) < share
    track[wrong] += 3.0
    return track


def test_turn_and_shift_are_found_beside_wrong_instants():
    found = registered(noisy(0), TURN * noisy(1, 0.2) + SHIFT)
    assert found is not None
    assert abs(found.turn - TURN) < 0.03
    assert abs(found.shift - SHIFT) < 0.06
    assert not found.mirrored
    assert found.agreeing >= 0.7 * found.common


def test_a_mirrored_way_is_recognized():
    found = registered(noisy(0), (TURN * noisy(1) + SHIFT).conjugate())
    assert found is not None
    assert found.mirrored


def test_a_straight_way_is_not_called_mirrored():
    line = np.linspace(-2.0, 2.0, 60).astype(complex)
    found = registered(line, (TURN * line + SHIFT).conjugate())
    assert found is not None
    assert not found.mirrored


@pytest.mark.parametrize("known", [slice(0, 10), slice(0, 0)])
def test_too_few_common_instants(known):
    other = np.full(len(PATH), np.nan + 0j)
    other[known] = PATH[known]
    assert registered(PATH, other) is None


def test_a_person_who_stands_gives_nothing():
    assert registered(0.05 * PATH, 0.05 * PATH) is None


def test_cameras_are_joined_along_the_pairs_that_agree():
    early, late = noisy(0), noisy(1)
    early[80:], late[:40] = np.nan, np.nan  # these two have 40 instants in common with each other and more with the third
    tracks = {"a": early, "b": TURN * noisy(2) + SHIFT, "c": late, "alone": np.full(len(PATH), np.nan + 0j)}
    placed = joined(list(tracks), pairs_of(tracks))
    assert set(placed) == {"a", "b", "c"}
    in_common = {name: motion.turn * tracks[name] + motion.shift for name, motion in placed.items()}
    assert np.nanmedian(np.abs(in_common["a"] - in_common["c"])) < 0.15
