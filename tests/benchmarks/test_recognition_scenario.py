"""Scoring of a stream's answers: cases by hand, and properties of every score."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.cases.recognition.scenario import Event, events_of, overlaps, score_of, session_of, sum_of
from zenocap.simulation.motion.posture_style import POSTURES

EVENTS = [Event("kick", 1.0, 3.0), Event(None, 4.0, 6.0), Event("squat", 7.0, 9.0), Event("kick", 9.0, 11.0)]


def answer(label: str | None, start_s: float, end_s: float) -> Event:
    return Event(label, start_s, end_s, at_s=end_s + 0.25)


RIGHT = [answer("kick", 1.5, 3.5), answer("squat", 7.0, 8.5), answer("kick", 8.5, 11.0)]


@pytest.mark.parametrize(
    ("answers", "right", "wrong", "unknown_wrong", "delays_s"),
    [
        pytest.param(RIGHT, 3, 0, 0, (0.75, -0.25, 0.25), id="matching answers, delayed from the true end"),
        pytest.param([answer("squat", 1.0, 3.0)], 0, 1, 0, (), id="another posture: wrong for answer and event"),
        pytest.param([answer("squat", 4.0, 6.0)], 0, 1, 1, (), id="a posture for an unknown movement"),
        pytest.param([answer("kick", 1.0, 3.0), answer("kick", 1.1, 2.9)], 1, 1, 0, (0.25,), id="one right an event"),
        pytest.param([answer(None, 4.0, 6.0), answer(None, 1.0, 3.0)], 0, 0, 0, (), id="no posture is never wrong"),
    ],
)
def test_answers_are_right_or_wrong(
    answers: list[Event], right: int, wrong: int, unknown_wrong: int, delays_s: tuple[float, ...]
) -> None:
    score = score_of(EVENTS, answers, 2.0)
    assert (score.right, score.wrong, score.events, score.unknown) == (right, wrong, 3, 1)
    assert score.unknown_wrong == unknown_wrong
    assert score.delays_s == pytest.approx(delays_s)


def test_answer_belongs_to_the_event_with_the_largest_overlap() -> None:
    events = [Event("kick", 0.0, 2.0), Event("kick", 2.0, 4.0)]
    score = score_of(events, [answer("kick", 0.9, 3.9), answer("kick", 0.0, 2.0)], 1.0)
    assert score.right == 2
    assert score.delays_s == pytest.approx((0.15, 0.25))


@pytest.mark.parametrize(("end_s", "expected"), [(1.4, False), (1.5, True), (3.0, True)])
def test_overlap_must_be_half_of_the_shorter_interval(end_s: float, expected: bool) -> None:
    assert overlaps(Event("kick", 1.0, 3.0), Event("kick", end_s - 1.0, end_s)) is expected


SPANS = st.tuples(st.sampled_from([None, "kick", "squat"]), st.floats(0, 50), st.floats(0.5, 4)).map(
    lambda found: Event(found[0], found[1], found[1] + found[2], at_s=found[1] + found[2])
)


@pytest.mark.slow
@given(st.lists(SPANS, max_size=12), st.lists(SPANS, max_size=12))
def test_counts_of_a_score_are_consistent(events: list[Event], answers: list[Event]) -> None:
    score = score_of(events, answers, 1.0)
    assert score.right + score.wrong == sum(one.label is not None for one in answers)
    assert score.right <= score.events == sum(event.label is not None for event in events)
    assert len(score.delays_s) == score.right
    assert score.unknown_wrong <= score.unknown


def test_scores_of_sessions_are_added() -> None:
    one, other = (score_of(EVENTS, [answer(label, 1.0, 3.0)], 2.0) for label in ("kick", "squat"))
    both = sum_of([one, other])
    assert (both.right, both.wrong, both.events, both.minutes) == (1, 1, 6, 4.0)
    assert both.delays_s == one.delays_s


def test_session_has_ordered_postures_and_other_movements_of_the_given_duration() -> None:
    script = session_of(3, 0.5)
    events = events_of(script)
    assert script.duration_s >= 30
    assert {event.label for event in events} - set(POSTURES) == {None}
    assert all(one.end_s <= later.start_s + 1e-9 for one, later in pairwise(events))
    assert events_of(session_of(3, 0.5)) == events
