"""Thresholds between right ones and strangers."""

import numpy as np
import pytest

from services.recognizer.examples import prepared
from services.recognizer.model import LEAST_SCORE
from services.recognizer.thresholds import FURTHEST, NEAREST, groups_of, thresholds_of
from tests.posture_cases import FAST, examples

RIGHT = np.random.default_rng(0).normal(1.0, 0.2, 24)


def test_strangers_that_are_near_raise_the_threshold_and_far_ones_do_not() -> None:
    near, far, none = (
        thresholds_of([RIGHT], [strangers])[0]
        for strangers in (np.full(24, 0.6), np.full(24, -3.0), np.zeros(0))
    )  # fmt: skip
    assert near > far
    assert far == pytest.approx(none, abs=0.02)


def test_a_threshold_lies_below_the_right_ones_within_its_limits() -> None:
    for strangers in (np.full(50, 5.0), np.full(50, -50.0)):
        found = thresholds_of([RIGHT], [strangers])[0]
        width = 0.25
        assert RIGHT.mean() - FURTHEST * width <= found <= RIGHT.mean() - NEAREST * 0.1


def test_a_posture_without_held_out_examples_leans_on_the_others() -> None:
    found = thresholds_of([RIGHT, np.zeros(0)], [np.zeros(0), np.zeros(0)])
    assert found[1] == pytest.approx(found[0], abs=0.1)
    np.testing.assert_array_equal(thresholds_of([np.zeros(0)], [np.zeros(0)]), [LEAST_SCORE])


@pytest.mark.parametrize(("people", "folds", "count"), [((1, 2, 3), 2, 2), ((1, 2, 3), 4, 3), ((1,), 4, 2)])
def test_groups_share_all_examples_and_no_person_is_in_two(people: tuple[int, ...], folds: int, count: int) -> None:
    ready = prepared(examples(people), FAST)
    groups = groups_of(ready, folds)
    assert len(groups) == count
    assert sorted(k for group in groups for k in group) == list(range(len(ready.examples)))
    if len(people) > 1:
        each = [{ready.examples[k].person for k in group} for group in groups]
        assert all(not one & other for one in each for other in each if one is not other)


def test_one_example_of_everything_has_nothing_to_hold_out() -> None:
    assert groups_of(prepared(examples((1,), 1), FAST), 4) == []
