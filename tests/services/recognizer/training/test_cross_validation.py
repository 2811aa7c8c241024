"""Two protocols of held-out examples, counted as in the paper's Table 2."""

from dataclasses import replace

import numpy as np
import pytest

from tests.services.recognizer.training.test_train import of_both
from tests.support.posture_cases import FAST, LABELS, examples, movement
from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.cross_validation import (
    PROTOCOLS,
    HeldOutResult,
    Protocol,
    ValidationOutcome,
    by_person,
    by_repetition,
    cross_validate,
)
from zenocap.services.recognizer.training.examples import Example, TrainingSettings, prepare

ANSWERS = ((0, 0, 0, 1.0), (1, 0, 1, -2.0), (2, 1, 1, 3.0), (3, 0, 1, -1.0), (4, 2, 0, -1.0))
OUTCOME = ValidationOutcome("paper", ("a", "b", "c"), 2, tuple(HeldOutResult(*one) for one in ANSWERS))


def test_counts_follow_from_the_answers() -> None:
    np.testing.assert_array_equal(OUTCOME.confusion, [[1, 2, 0], [0, 1, 0], [1, 0, 0]])
    assert (OUTCOME.right, OUTCOME.total) == (2, 5)
    assert (list(OUTCOME.correct), list(OUTCOME.tested)) == ([1, 1, 0], [3, 1, 1])
    assert OUTCOME.confusions == [("a", "b", 2), ("c", "a", 1)]


@pytest.mark.parametrize("protocol", PROTOCOLS)
@of_both
def test_every_example_is_tested_once_and_recognized(settings: TrainingSettings, protocol: Protocol) -> None:
    outcome = cross_validate(examples(), settings, protocol)
    assert [answer.example for answer in outcome.answers] == list(range(len(examples())))
    assert (outcome.right, outcome.total, outcome.people) == (18, 18, 3)
    assert settings is not FAST or all(answer.margin > 0 for answer in outcome.answers)


@pytest.mark.slow
def test_no_person_is_tested_with_a_model_trained_on_them() -> None:
    """One person's waves equal all others' kicks: recognized by the paper's protocol, not by leave-subjects-out."""
    own = [replace(e, label={"wave": "kick", "kick": "wave"}.get(e.label, e.label)) for e in examples((9,), 6)]
    others = examples((1,))
    both = {protocol: cross_validate([*others, *own], FAST, protocol) for protocol in PROTOCOLS}
    odd = [len(others) + k for k, example in enumerate(own) if example.label != "bow"]
    wrong = {
        name: sum(answer.true != answer.given for answer in found.answers if answer.example in odd)
        for name, found in both.items()
    }
    assert wrong["subjects"] == len(odd)
    assert wrong["paper"] < len(odd) / 2


def test_by_person_each_group_is_one_person() -> None:
    ready = prepare(examples(), FAST)
    assert [{ready.examples[k].person for k in group} for group in by_person(ready)] == [{"1"}, {"2"}, {"3"}]


def test_by_repetition_each_person_and_posture_is_in_both_halves() -> None:
    ready = prepare(examples(repetitions=3), FAST)
    halves = by_repetition(ready)
    assert sorted(k for half in halves for k in half) == list(range(27))
    for half in halves:
        assert {(ready.examples[k].person, ready.examples[k].label) for k in half} == {
            (person, label) for person in "123" for label in LABELS
        }


def test_single_repetitions_are_split_by_person() -> None:
    outcome = cross_validate(examples(repetitions=1), FAST, "paper")
    assert outcome.total == 9


@pytest.mark.slow
def test_a_posture_of_only_one_person_is_a_class_but_is_not_tested() -> None:
    alone = Example("stretch", "1", "1", 15.0, movement("stretch", 1, 1))
    for protocol in PROTOCOLS:
        outcome = cross_validate([*examples(), alone], FAST, protocol)
        assert (outcome.total, outcome.tested[3]) == (18, 0)
        assert outcome.labels[3] == "stretch"


def test_error_names_the_examples_that_cross_validation_needs() -> None:
    with pytest.raises(UserError, match="9 examples by 1 people: allowed: two people or more that perform one posture"):
        cross_validate(examples((1,), 3), FAST, "subjects")
    with pytest.raises(UserError, match="3 examples by 1 people: allowed: two examples or more of one posture"):
        cross_validate(examples((1,), 1), FAST, "paper")
