"""Thresholds between true examples and unknown movements."""

import numpy as np
import pytest

from tests.support.posture_cases import FAST, examples
from zenocap.services.recognizer.model import NO_THRESHOLD
from zenocap.services.recognizer.training.examples import prepare
from zenocap.services.recognizer.training.parameters import FURTHEST, NEAREST
from zenocap.services.recognizer.training.thresholds import held_out_groups, train_thresholds

TRUE_SCORES = np.random.default_rng(0).normal(1.0, 0.2, 24)


def test_near_scores_of_unknown_movements_raise_the_threshold_and_far_ones_do_not() -> None:
    near, far, none = (
        train_thresholds([TRUE_SCORES], [unknown_scores])[0]
        for unknown_scores in (np.full(24, 0.6), np.full(24, -3.0), np.zeros(0))
    )  # fmt: skip
    assert near > far
    assert far == pytest.approx(none, abs=0.02)


def test_a_threshold_is_below_the_true_scores_within_its_limits() -> None:
    for unknown_scores in (np.full(50, 5.0), np.full(50, -50.0)):
        found = train_thresholds([TRUE_SCORES], [unknown_scores])[0]
        width = 0.25
        assert TRUE_SCORES.mean() - FURTHEST * width <= found <= TRUE_SCORES.mean() - NEAREST * 0.1


def test_the_threshold_without_held_out_examples_is_that_of_the_other_postures() -> None:
    found = train_thresholds([TRUE_SCORES, np.zeros(0)], [np.zeros(0), np.zeros(0)])
    assert found[1] == pytest.approx(found[0], abs=0.1)
    np.testing.assert_array_equal(train_thresholds([np.zeros(0)], [np.zeros(0)]), [NO_THRESHOLD])


@pytest.mark.parametrize(("people", "folds", "count"), [((1, 2, 3), 2, 2), ((1, 2, 3), 4, 3), ((1,), 4, 2)])
def test_groups_have_all_examples_and_no_person_is_in_two_groups(people: tuple[int, ...], folds: int, count: int) -> None:
    ready = prepare(examples(people), FAST)
    groups = held_out_groups(ready, folds)
    assert len(groups) == count
    assert sorted(k for group in groups for k in group) == list(range(len(ready.examples)))
    if len(people) > 1:
        each = [{ready.examples[k].person for k in group} for group in groups]
        assert all(not one & other for one in each for other in each if one is not other)


def test_single_examples_give_no_held_out_groups() -> None:
    assert held_out_groups(prepare(examples((1,), 1), FAST), 4) == []
