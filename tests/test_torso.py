import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from common.body.torso import TURNS, tilt_of_spine, torso_rotation, width_thresholds

TILTS = st.floats(-1.5, 1.5)


@given(st.floats(-7, 7), TILTS, TILTS)
def test_the_spine_gives_lean_and_roll_back(yaw: float, lean: float, roll: float) -> None:
    rotation = torso_rotation(yaw, lean, roll)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(tilt_of_spine(rotation[:, 1], yaw), (lean, roll), atol=1e-6)


def test_lean_is_forward_and_a_positive_roll_to_the_persons_right() -> None:
    assert torso_rotation(0.0, 0.3, 0.0)[2, 1] > 0.2
    assert torso_rotation(0.0, 0.0, 0.3)[0, 1] < -0.2  # X is the person's left
    np.testing.assert_allclose(torso_rotation(np.pi / 2, 0.0, 0.0)[:, 2], [1, 0, 0], atol=1e-12)


@given(st.floats(0.05, 0.5), st.floats(0.01, 0.5))
def test_thresholds_lie_between_the_two_widths(flank: float, gap: float) -> None:
    low, high = width_thresholds(flank, flank + gap)
    assert flank < low < high < flank + gap


def test_the_turns_tried_are_evenly_spaced_around_none() -> None:
    np.testing.assert_allclose(np.diff(TURNS), TURNS[1] - TURNS[0])
    np.testing.assert_allclose(TURNS, -TURNS[::-1])
