"""Held steps: exchanged legs, and people and feet of the takes."""

import numpy as np

from benchmarks.cases.held import OTHER_LEG, exchanged, takes

STEP = np.array([[-0.1, 0.5, 0.2], [-0.1, 0.1, 0.2], [0.1, 0.5, -0.2], [0.1, 0.1, -0.2]])  # right knee, ankle, left ones


def test_exchanged_legs_are_neither_those_that_are_off_nor_those_side_by_side() -> None:
    beside = STEP * [0.1, 1.0, 0.0]
    found = np.array([STEP, STEP[OTHER_LEG], STEP[OTHER_LEG] + 0.05, STEP + 0.1, STEP, np.full((4, 3), np.nan)])
    true = np.array([STEP, STEP, STEP, STEP, beside, STEP])
    assert exchanged(found, true).tolist() == [False, True, True, False, False, False]


def test_each_take_is_of_another_person_and_both_feet_are_ahead_at_every_heading() -> None:
    cases = takes(500, ("a", "b")).values()
    assert sorted({one.option("person", 0) for one in cases}) == list(range(500, 512))
    assert len({(one.option("heading", 0), one.option("ahead", 0)) for one in cases}) == 12
