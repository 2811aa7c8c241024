"""Streams of real motion: movements joined without a step, halves without a common take."""

import numpy as np
import pytest

from benchmarks.recognition.real_stream import BLEND_S, RATE, Movement, halves, joined, movements_of, resampled
from zenocap.common.arrays import Floats
from zenocap.services.recognizer.motion_rows import HEADING, WAY, WIDTH
from zenocap.services.recognizer.training.examples import Example


def walk(count: int, heading: float, x: float) -> Floats:
    """Rows (count, WIDTH) of somebody who walks straight on at 1 m/s, from (x, 0) in a direction."""
    rows = np.zeros((count, WIDTH))
    direction = np.array([np.sin(heading), np.cos(heading)])
    rows[:, HEADING] = direction
    rows[:, WAY] = np.array([x, 0.0]) + np.arange(count)[:, None] / RATE * direction
    return rows


def test_a_movement_begins_where_and_in_the_direction_in_which_the_last_one_ended() -> None:
    first, second = Movement(walk(60, 0.3, 5.0), "walk", "a"), Movement(walk(120, 2.0, -7.0), None, "b", 2)
    rows, events = joined([first, second])
    assert np.abs(np.diff(rows[:, WAY], axis=0)).max() < 1.1 / RATE
    np.testing.assert_allclose(rows[:, HEADING], np.broadcast_to(rows[0, HEADING], (len(rows), 2)), atol=1e-9)
    assert np.linalg.norm(rows[-1, WAY] - rows[0, WAY]) == pytest.approx((59 + 119) / RATE)
    spans = [(event.label, event.start_s, event.end_s) for event in events]
    assert spans == [("walk", 0.0, 1.0), (None, 1.0 + BLEND_S, 2.0 + BLEND_S), (None, 2.0 + BLEND_S, 3.0 + BLEND_S)]


def test_overlapping_strides_of_a_walk_become_one_movement() -> None:
    whole = walk(240, 0.0, 0.0)  # 2.4 s at 100/s: strides of 1.2 s, one begun in the middle of another
    strides = [Example("walk", "one", str(k), 100.0, whole[60 * k : 60 * k + 120]) for k in range(3)]
    (movement,) = movements_of(strides)
    assert movement.parts == 2
    np.testing.assert_allclose(movement.rows[:, WAY], resampled(whole, 100.0)[:, WAY], atol=1e-9)


def test_no_take_is_trained_and_tested_and_each_is_tested_once() -> None:
    rows = walk(30, 0.0, 0.0)
    examples = [Example("walk", f"take {k}", str(n), RATE, rows) for k in range(3) for n in range(2)]
    examples += [Example("jump", "take 9", "0", RATE, rows)]
    seen = []
    for tested, trained in halves(examples):
        assert {one.person for one in tested}.isdisjoint(one.person for one in trained)
        assert len(tested) + len(trained) == len(examples)
        seen += [str(one) for one in tested]
    assert sorted(seen) == sorted(str(one) for one in examples if one.label == "walk")
