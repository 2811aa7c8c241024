"""Streams of simulated people: random postures with pauses and unknown movements.

An answer is right when it has the label of a posture and overlaps it by half of the shorter one; delay: from the scripted
end to the time of the answer.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.cases.recognition.examples import session_take
from benchmarks.cases.recognition.scenario import Event, EventScore, events_of, score_of, session_of, sum_of
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from tests.support.stored import stored
from zenocap.common.arrays import Floats
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.services.recognizer.stream import StreamSetup, initial_stream, push, stream_setup
from zenocap.services.recognizer.training.example_files import read_features
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.tools.teach.dataset.batch import people

MODEL = "fifteen"
STREAM_SEED = 10  # persons from 120 on
PEOPLE = 4  # of a seed
Session = tuple[MotionTimeline, Floats, Floats]  # what happens, and times (T,) and rows (T, d) of the poses


def run(one: Case) -> Figures:
    """Figures of four people.  Options: poses, minutes (of each), people."""
    setup = stream_setup(read_model(find_model(MODEL)))
    each = sessions(one.option("poses", "truth"), one.seed, one.option("people", PEOPLE), one.option("minutes", 5.0))
    return figures(sum_of([score_of_session(setup, session) for session in each]))


def figures(score: EventScore) -> dict[str, float]:
    found = {
        "postures": score.events,
        "other movements": score.unknown,
        "refused": score.unknown - score.unknown_wrong,
        "false": 60.0 * score.wrong / score.minutes,
        "recall": 100.0 * score.right / max(score.events, 1),
    }
    if answered := score.right + score.wrong:
        found["precision"] = 100.0 * score.right / answered
    if score.delays_s:
        found["delay p50"], found["delay p95"] = map(float, np.quantile(score.delays_s, (0.5, 0.95)))
    return found


def sessions(method: str, seed: int, count: int, minutes: float) -> Iterator[Session]:
    """Sessions of some people, their poses by a method."""
    first = people(STREAM_SEED)[0] + PEOPLE * seed
    for who in range(first, first + count):
        script = session_of(who, minutes)
        yield script, *stored(lambda: _rows(method, script, who), method, who, minutes, sources=(__name__,))  # noqa: B023


def _rows(method: str, script: MotionTimeline, seed: int) -> tuple[Floats, Floats]:
    with tempfile.TemporaryDirectory() as place:
        motion = read_features(session_take(method, script, seed, Path(place)), DEFAULT)
    return motion.times_s, motion.features


def score_of_session(setup: StreamSetup, session: Session) -> EventScore:
    """Score of the answers to a session."""
    script, times_s, rows = session
    stream = initial_stream(setup)
    answers = []
    for time_s, row in zip(times_s, rows, strict=True):
        if time_s < script.motion_from_s:
            continue
        stream, answer, _ = push(setup, stream, round(time_s * 1e9), row)
        if answer is not None:
            answers.append(Event(answer.label, answer.start_ns / 1e9, answer.end_ns / 1e9, float(time_s)))
    return score_of(events_of(script), answers, (script.duration_s - script.motion_from_s) / 60.0)


COLUMNS = (
    Quantity("precision", "%", 1, "low"),
    Quantity("recall", "%", 1, "low"),
    Quantity("false", "an hour", 0),
    Quantity("delay p50", "s", 2),
    Quantity("delay p95", "s", 2),
    *(Quantity(name, "", 0, joined="sum") for name in ("postures", "other movements", "refused")),
)
STREAM = Kind(
    "stream",
    "Postures, pauses and other movements of simulated people as a stream, with the shipped model, which was trained on "
    "others; three sets of four people, 5 minutes each. Other movements: bend, lean, twist, reach, sit, lunge, gesture, "
    "walking back.",
    run,
    COLUMNS,
    {poses: case("stream", poses=poses) for poses in ("two-view", "hybrid", "truth")},
    case("stream", people=1, minutes=0.5),
    rows="poses from",
)
