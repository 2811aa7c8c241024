"""Sessions of the kind `stream`, and its figures of answers to other movements than postures."""

from itertools import pairwise

import pytest

from benchmarks.cases.recognition.streams import OTHER, figures, session_of, spans_of
from zenocap.services.recognizer.training.stream_evaluation import PostureAnswer, PostureSpan, StreamOutcome
from zenocap.simulation.motion.posture_style import POSTURES

TRUTH = (PostureSpan("kick", 1.0, 3.0), PostureSpan("squat", 7.0, 9.0), PostureSpan("kick", 9.0, 11.0))
MOVEMENT = PostureSpan(OTHER, 4.0, 6.0)


def answer(label: str, start_s: float, end_s: float) -> PostureAnswer:
    return PostureAnswer(label, start_s, end_s, end_s + 0.25, level=1.0, confidence=1.0)


@pytest.mark.parametrize(
    ("answers", "recall", "wrong", "refused"),
    [
        pytest.param([answer("kick", 1.5, 3.5), answer("squat", 7.0, 8.5)], 200 / 3, 0, 1, id="matching answers"),
        pytest.param([answer("squat", 1.0, 3.0)], 0, 1, 1, id="another posture"),
        pytest.param([answer("squat", 4.0, 6.0)], 0, 1, 0, id="a posture for another movement"),
        pytest.param([answer("kick", 1.0, 5.0)], 100 / 3, 0, 1, id="a right answer that goes on into a movement"),
    ],
)
def test_a_movement_is_refused_unless_a_wrong_answer_overlaps_it(
    answers: list[PostureAnswer], recall: float, wrong: int, refused: int
) -> None:
    found = figures(StreamOutcome(POSTURES, (TRUTH,), (tuple(answers),), hours=1.0), [[MOVEMENT]])
    assert (found["postures"], found["other movements"], found["refused"]) == (3, 1, refused)
    assert (found["recall"], found["false"]) == (pytest.approx(recall), wrong)


def test_session_has_ordered_postures_and_other_movements_of_the_given_duration() -> None:
    script = session_of(3, 0.5)
    spans = spans_of(script)
    assert script.duration_s >= 30
    assert {span.label for span in spans} - set(POSTURES) == {OTHER}
    assert all(one.end_s <= later.start_s + 1e-9 for one, later in pairwise(spans))
    assert spans_of(session_of(3, 0.5)) == spans
