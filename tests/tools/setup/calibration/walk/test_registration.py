"""Ways of one person as several cameras see them: turned and shifted, mirrored, unrelated."""

import numpy as np

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
    assert abs(found.turn - TURN) < 0.03
    assert abs(found.shift - SHIFT) < 0.06
    assert not found.mirrored
    assert found.agreeing >= 0.7 * found.common


def test_a_mirrored_way_is_recognized_unless_it_is_straight():
    assert registered(noisy(0), (TURN * noisy(1) + SHIFT).conjugate()).mirrored
    line = np.linspace(-2.0, 2.0, 60).astype(complex)
    assert not registered(line, (TURN * line + SHIFT).conjugate()).mirrored  # a straight way looks the same


def test_few_common_instants_and_a_person_who_stands_give_nothing():
    for count in (0, 10):
        assert registered(PATH, np.where(np.arange(len(PATH)) < count, PATH, np.nan + 0j)) is None
    assert registered(0.05 * PATH, 0.05 * PATH) is None


def test_cameras_are_joined_along_the_pairs_that_agree():
    early, late = noisy(0), noisy(1)
    early[80:], late[:40] = np.nan, np.nan  # these two have 40 instants in common with each other and more with the third
    tracks = {"a": early, "b": TURN * noisy(2) + SHIFT, "c": late, "alone": np.full(len(PATH), np.nan + 0j)}
    placed = joined(list(tracks), pairs_of(tracks))
    assert set(placed) == {"a", "b", "c"}
    in_common = {name: motion.turn * tracks[name] + motion.shift for name, motion in placed.items()}
    assert np.nanmedian(np.abs(in_common["a"] - in_common["c"])) < 0.15
