"""Thresholds for a rate of false postures, learnt from background that holds movement like a posture."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.posture_cases import FAST_FOREST, RATE, examples, movement
from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import packed, parse_model
from zenocap.services.recognizer.motion_rows import WIDTH
from zenocap.services.recognizer.stream import initial_stream, push, recognitions, stream_setup
from zenocap.services.recognizer.training.background import halves_of, open_setup, windows_of
from zenocap.services.recognizer.training.examples import BACKGROUND, Example
from zenocap.services.recognizer.training.train import train

PATH = Path("some.postures")
LIMITED = replace(FAST_FOREST, false_per_hour=2.0)


def everyday(person: int, count: int) -> Floats:
    """(T, WIDTH) rows of the untaught `stretch`, between rests; every fourth is a `wave` of half the size."""
    rows = []
    for k in range(count):
        one = movement("stretch" if k % 4 else "wave", person, 100 + k)
        rows += [one, np.repeat(one[:1], int(RATE), axis=0)]
    return np.concatenate(rows)


def background(people: range, count: int = 12) -> list[Example]:
    return [Example(BACKGROUND, f"other {person}", "1", RATE, everyday(person, count)) for person in people]


def falses(model: PostureModel, people: range) -> int:
    """Windows that the model answers in everyday movement of people."""
    setup, found = stream_setup(model), 0
    for rows in (everyday(person, 12) for person in people):
        answers = recognitions(setup, [round(k * setup.period_ns) for k in range(len(rows))], rows)
        found += sum(answer.label is not None for number, answer in answers if number < len(rows))
    return found


@pytest.mark.nightly
def test_the_rate_holds_in_the_background_and_is_kept_in_the_file() -> None:
    people = [*examples(range(1, 7)), *background(range(20, 24))]
    model, usual = train(people, LIMITED), train(people, FAST_FOREST)
    alarms = model.forest.alarms
    assert usual.forest.alarms is None
    assert alarms.per_hour <= 2.0 <= alarms.most_per_hour
    np.testing.assert_allclose(model.forest.thresholds, np.maximum(usual.forest.thresholds, alarms.least))
    data = packed(PATH, model)
    again = parse_model(PATH, data).forest
    np.testing.assert_array_equal(again.alarms.shares, alarms.shares)
    assert (again.alarms.hours, again.alarms.least) == (alarms.hours, alarms.least)
    assert parse_model(PATH, packed(PATH, usual)).forest.alarms is None
    assert falses(model, range(60, 70)) <= falses(usual, range(60, 70))


@pytest.mark.nightly
def test_windows_are_all_those_that_a_stream_decides_on() -> None:
    model = replace(train(examples(range(1, 7)), FAST_FOREST), forest=None)
    rows = everyday(20, 12)
    every = windows_of(model, [rows])
    strict = windows_of(replace(model, farthest=1e-6), [rows])  # which a stream would answer without a posture
    assert len(every) >= 3
    assert len(strict) == len(every)


@pytest.mark.nightly
def test_windows_before_a_gap_are_counted_as_in_a_stream() -> None:
    model = replace(train(examples(range(1, 7)), FAST_FOREST), forest=None)
    sequences = [movement("wave", person, 7) for person in range(20, 26)]  # each ends with the movement
    setup, found, from_ns = open_setup(model), 0, 0
    stream = initial_stream(setup)
    for rows in (*sequences, np.full((5, WIDTH), np.nan)):
        for row in rows:
            stream, answer, _ = push(setup, stream, from_ns, row)
            found += answer is not None and answer.label is not None
            from_ns += round(setup.period_ns)
        from_ns += round(1e9)
    assert found >= len(sequences) - 1
    assert len(windows_of(model, sequences)) == found


def test_halves_cut_the_sequence_in_the_middle() -> None:
    sequences = [np.full((length, 2), float(length)) for length in (10, 30, 4)]
    first, second = halves_of(sequences)
    assert [len(rows) for rows in first] == [10, 12]
    assert [len(rows) for rows in second] == [18, 4]


def test_a_rate_needs_background_and_a_forest() -> None:
    with pytest.raises(UserError, match=r"false_per_hour = 2: no background: allowed: with rows of posture '-'"):
        train(examples(), LIMITED)
    with pytest.raises(UserError, match=r"allowed: for the classifier forest"):
        replace(LIMITED, classifier="paper")
    for wrong in (0.0, -1.0, float("nan"), 1e6):
        with pytest.raises(UserError, match=r"false_per_hour = .*: allowed: 0.001 to 3600"):
            replace(LIMITED, false_per_hour=wrong)
