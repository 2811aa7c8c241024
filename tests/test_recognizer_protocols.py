"""Two ways of holding out, counted as the paper's Table 2."""

from dataclasses import replace

import numpy as np
import pytest

from services.recognizer.examples import Example, ExampleError, prepared
from services.recognizer.protocols import PROTOCOLS, Answer, Outcome, Protocol, by_person, by_repetition, evaluated
from tests.posture_cases import FAST, LABELS, examples, movement

HAND = Outcome(
    "paper",
    ("a", "b", "c"),
    2,
    (Answer(0, 0, 0, 1.0), Answer(1, 0, 1, -2.0), Answer(2, 1, 1, 3.0), Answer(3, 0, 1, -1.0), Answer(4, 2, 0, -1.0)),
)


def test_counts_are_what_the_answers_say() -> None:
    np.testing.assert_array_equal(HAND.confusion, [[1, 2, 0], [0, 1, 0], [1, 0, 0]])
    assert (HAND.right, HAND.total) == (2, 5)
    assert (list(HAND.correct), list(HAND.tested)) == ([1, 1, 0], [3, 1, 1])
    assert HAND.confusions == [("a", "b", 2), ("c", "a", 1)]


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_example_is_tested_once_and_these_are_all_told_apart(protocol: Protocol) -> None:
    outcome = evaluated(examples(), FAST, protocol)
    assert [answer.example for answer in outcome.answers] == list(range(len(examples())))
    assert (outcome.right, outcome.total, outcome.people) == (18, 18, 3)
    assert all(answer.margin > 0 for answer in outcome.answers)


def test_nobody_is_tested_on_what_was_learnt_from_them() -> None:
    """A person whose waves are everybody else's kicks is recognised by the paper's protocol and not by the other."""
    own = [replace(e, label={"wave": "kick", "kick": "wave"}.get(e.label, e.label)) for e in examples((9,), 6)]
    others = examples((1,))
    both = {protocol: evaluated([*others, *own], FAST, protocol) for protocol in PROTOCOLS}
    odd = [len(others) + k for k, example in enumerate(own) if example.label != "bow"]
    wrong = {
        name: sum(answer.true != answer.given for answer in found.answers if answer.example in odd)
        for name, found in both.items()
    }
    assert wrong["subjects"] == len(odd)
    assert wrong["paper"] < len(odd) / 2


def test_by_person_each_group_is_one_person() -> None:
    ready = prepared(examples(), FAST)
    assert [{ready.examples[k].person for k in group} for group in by_person(ready)] == [{"1"}, {"2"}, {"3"}]


def test_by_repetition_each_person_and_posture_is_in_both_halves() -> None:
    ready = prepared(examples(repetitions=3), FAST)
    halves = by_repetition(ready)
    assert sorted(k for half in halves for k in half) == list(range(27))
    for half in halves:
        assert {(ready.examples[k].person, ready.examples[k].label) for k in half} == {
            (person, label) for person in "123" for label in LABELS
        }


def test_single_repetitions_are_shared_out_among_the_people() -> None:
    outcome = evaluated(examples(repetitions=1), FAST, "paper")
    assert outcome.total == 9


def test_a_posture_that_nobody_else_shows_stands_against_the_others_and_is_not_tested() -> None:
    alone = Example("stretch", "1", "1", 15.0, movement("stretch", 1, 1))
    for protocol in PROTOCOLS:
        outcome = evaluated([*examples(), alone], FAST, protocol)
        assert (outcome.total, outcome.tested[3]) == (18, 0)
        assert outcome.labels[3] == "stretch"


def test_where_nothing_can_be_held_out_it_says_what_is_needed() -> None:
    with pytest.raises(ExampleError, match="9 examples by 1 people: allowed: two people or more that show one posture"):
        evaluated(examples((1,), 3), FAST, "subjects")
    with pytest.raises(ExampleError, match="3 examples by 1 people: allowed: two examples or more of one posture"):
        evaluated(examples((1,), 1), FAST, "paper")
