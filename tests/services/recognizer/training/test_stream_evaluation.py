"""Streams compared with labelled spans: matches, delays, rates, and the operating curve."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.posture_cases import FAST_FOREST, RATE, examples, movement
from zenocap.services.recognizer.training.example_files import Features
from zenocap.services.recognizer.training.stream_evaluation import (
    PostureAnswer,
    PostureSpan,
    StreamOutcome,
    evaluate_streams,
    overlaps,
)
from zenocap.services.recognizer.training.train import train

HOUR = 1.0


def answer(label: str, start_s: float, end_s: float, at_s: float, level: float) -> PostureAnswer:
    return PostureAnswer(label, start_s, end_s, at_s, level, confidence=0.5)


def outcome(truth: list[PostureSpan], given: list[PostureAnswer]) -> StreamOutcome:
    return StreamOutcome(("wave", "kick"), (tuple(truth),), (tuple(given),), HOUR)


def test_an_answer_is_right_by_label_and_overlap_and_a_span_counts_once() -> None:
    truth = [PostureSpan("wave", 1.0, 3.0), PostureSpan("kick", 5.0, 7.0)]
    given = [
        answer("wave", 1.2, 3.1, 3.3, 0.9),
        answer("wave", 2.0, 3.0, 3.4, 0.5),  # a second one of the same span
        answer("wave", 5.0, 7.0, 7.3, 0.6),  # another posture
        answer("kick", 6.5, 9.0, 9.2, 0.8),  # a quarter of the span
    ]
    found = outcome(truth, given)
    every, wave, kick = found.score(), found.score("wave"), found.score("kick")
    assert (every.events, every.right, every.wrong) == (2, 1, 3)
    assert (wave.recall, wave.precision, wave.false_per_hour) == (1.0, pytest.approx(1 / 3), 2.0)
    assert wave.delay_s(0.5) == pytest.approx(0.3)
    assert (kick.recall, kick.precision) == (0.0, 0.0)
    assert np.isnan(kick.delay_s(0.5))


def test_an_answer_belongs_to_the_span_with_the_largest_overlap() -> None:
    truth = [PostureSpan("wave", 0.0, 2.0), PostureSpan("wave", 2.0, 4.0)]
    found = outcome(truth, [answer("wave", 0.9, 3.9, 4.15, 0.9), answer("wave", 0.0, 2.0, 2.25, 0.9)]).score()
    assert found.right == 2
    assert found.delays_s == pytest.approx((0.15, 0.25))


@pytest.mark.parametrize(("end_s", "expected"), [(1.4, False), (1.5, True), (3.0, True)])
def test_the_overlap_is_half_of_the_shorter_one(end_s: float, expected: bool) -> None:
    assert overlaps(PostureSpan("kick", 1.0, 3.0), PostureSpan("kick", end_s - 1.0, end_s)) is expected


SPANS = st.tuples(st.sampled_from(["kick", "wave"]), st.floats(0, 50), st.floats(0.5, 4)).map(
    lambda drawn: PostureSpan(drawn[0], drawn[1], drawn[1] + drawn[2])
)


@pytest.mark.slow
@given(st.lists(SPANS, max_size=12), st.lists(SPANS, max_size=12))
def test_counts_of_a_score_are_consistent(truth: list[PostureSpan], given: list[PostureSpan]) -> None:
    score = outcome(truth, [answer(one.label, one.start_s, one.end_s, one.end_s, 0.5) for one in given]).score()
    assert score.right + score.wrong == len(given)
    assert score.right == len(score.delays_s) <= score.events == len(truth)


def test_the_curve_leaves_out_the_least_sure_answers_first() -> None:
    truth = [PostureSpan("wave", 1.0, 3.0), PostureSpan("kick", 5.0, 7.0)]
    given = [answer("wave", 1.0, 3.0, 3.3, 0.9), answer("kick", 5.0, 7.0, 7.3, 0.6), answer("kick", 8.0, 9.0, 9.3, 0.7)]
    curve = [(level, score.right, score.wrong) for level, score in outcome(truth, given).curve()]
    assert curve == [(0.6, 2, 1), (0.7, 1, 1), (0.9, 1, 0)]


@pytest.mark.nightly
@pytest.mark.parametrize("classifier", ["forest", "paper"])
def test_postures_of_an_unknown_person_are_found_where_they_are(classifier: str) -> None:
    model = train(examples(range(1, 7)), replace(FAST_FOREST, classifier=classifier))  # type: ignore[arg-type]
    parts, spans, at = [], [], 0
    for k, label in enumerate(("wave", "kick", "bow", "wave")):
        rows = movement(label, 30, k)
        rest = np.repeat(rows[:1], int(1.5 * RATE), axis=0)
        spans.append(PostureSpan(label, (at + len(rest)) / RATE, (at + len(rest) + len(rows)) / RATE))
        parts += [rest, rows]
        at += len(rest) + len(rows)
    features = np.concatenate(parts)  # the last posture ends with the stream
    found = evaluate_streams(model, [(Features(RATE, np.arange(at) / RATE, features), spans)])
    assert found.hours == pytest.approx(at / RATE / 3600)
    assert found.score().right >= 3
    assert found.score().wrong <= 1
    assert -0.5 < found.score().delay_s(0.5) < 0.6
    for one in found.answers[0]:
        if classifier == "forest":
            assert model.forest.thresholds.min() <= one.level <= 1.0
            assert round(one.level * 100) == pytest.approx(one.level * 100)
        else:
            assert one.level >= 0.0
