"""Description of segments: speeds, turns and ways in the body's frame, for any number of rows."""

import numpy as np
import pytest

from zenocap.services.recognizer.motion_rows import HEADING, HEIGHT, WAY, WIDTH
from zenocap.services.recognizer.segment_description import CHANNELS, VALUES, channels, describe

RATE = 15.0
FORWARDS, LEFTWARDS, LENGTH, TURN = range(HEIGHT + 1, HEIGHT + 5)


def walk(direction: float, heading: float, turn: float = 0.0, speed: float = 1.2, count: int = 30) -> np.ndarray:
    """(count, WIDTH) of a body that moves at `speed` (m/s) in `direction` and faces `heading` (rad from Z towards X)."""
    seconds = np.arange(count) / RATE
    rows = np.zeros((count, WIDTH))
    rows[:, WAY] = speed * seconds[:, None] * np.array([np.sin(direction), np.cos(direction)])
    facing = heading + turn * seconds
    rows[:, HEADING] = np.column_stack([np.sin(facing), np.cos(facing)])
    return rows


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_walking_forwards_left_and_back_are_told_apart_in_any_heading(heading: float) -> None:
    for away, forwards, leftwards in ((0.0, 1.2, 0.0), (np.pi / 2, 0.0, 1.2), (np.pi, -1.2, 0.0)):
        found = channels(walk(heading + away, heading), RATE)
        np.testing.assert_allclose(found[:, FORWARDS], forwards, atol=1e-9)
        np.testing.assert_allclose(found[:, LEFTWARDS], leftwards, atol=1e-9)
        np.testing.assert_allclose(found[:, LENGTH], 1.2)
        np.testing.assert_allclose(found[:, TURN], 0.0, atol=1e-9)


def test_a_turn_is_counted_over_more_than_half_a_circle() -> None:
    rows = walk(0.0, 3.0, turn=2.0, count=60)
    np.testing.assert_allclose(channels(rows, RATE)[:, TURN], 2.0)
    assert describe(rows, RATE)[-2] == pytest.approx(2.0 * 59 / RATE)


def test_the_end_of_the_description_is_way_turn_and_duration() -> None:
    forwards, leftwards, turn, duration = describe(walk(0.5 + np.pi / 2, 0.5, count=31), RATE)[-4:]
    assert (forwards, turn) == (pytest.approx(0.0, abs=1e-9), 0.0)
    assert leftwards == pytest.approx(1.2 * 30 / RATE)
    assert duration == pytest.approx(np.log(31 / RATE))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
def test_short_segments_have_finite_values(count: int) -> None:
    rows = walk(0.0, 1.0, count=count)
    assert channels(rows, RATE).shape == (count, CHANNELS)
    assert describe(rows, RATE).shape == (VALUES,)
    assert np.isfinite(describe(rows, RATE)).all()


def test_the_thirds_tell_a_movement_from_its_reverse() -> None:
    rows = walk(0.0, 0.0)
    rows[:, HEIGHT] = np.linspace(0.5, 0.2, len(rows))
    assert np.abs(describe(rows, RATE) - describe(rows[::-1].copy(), RATE)).max() > 0.1
