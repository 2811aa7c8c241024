"""Streams of simulated people: random postures with pauses and unknown movements.

An answer is right when it has the label of a posture and overlaps it by half of the shorter one; delay: from the scripted
end to the time of the answer.
"""

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.cases.recognition.examples import session_take
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from tests.support.stored import stored
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.services.recognizer.training.example_files import Features, read_features
from zenocap.services.recognizer.training.stream_evaluation import (
    PostureSpan,
    StreamOutcome,
    evaluate_streams,
    matched,
    overlaps,
)
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import RETURNING, MotionTimeline, session_timeline
from zenocap.tools.teach.dataset.batch import people

MODEL = "fifteen"
STREAM_SEED = 10  # persons from 120 on
PEOPLE = 4  # of a seed
OTHER = ""  # label of movements that are no posture
UNKNOWN_SHARE = 0.35  # of the movements
NO_PAUSE_SHARE = 0.15  # fraction that follows the previous one without a pause
PAUSES_S = (0.4, 2.5)
REPETITION_FROM = 10  # other repetitions than in the takes of the same people


def run(one: Case) -> Figures:
    """Figures of four people.  Options: poses, minutes (of each), people."""
    poses, minutes = one.option("poses", "truth"), one.option("minutes", 5.0)
    streams: list[tuple[Features, list[PostureSpan]]] = []
    others: list[list[PostureSpan]] = []
    first = people(STREAM_SEED)[0] + PEOPLE * one.seed
    for who in range(first, first + one.option("people", PEOPLE)):
        script = session_of(who, minutes)
        motion = stored(partial(_rows, poses, script, who), poses, who, minutes, sources=(__name__,))
        spans = spans_of(script)
        streams.append((motion, [span for span in spans if span.label != OTHER]))
        others.append([span for span in spans if span.label == OTHER])
    return figures(evaluate_streams(read_model(find_model(MODEL)), streams), others)


def figures(outcome: StreamOutcome, others: Sequence[Sequence[PostureSpan]]) -> dict[str, float]:
    """others: by stream.  One is refused where no wrong answer overlaps it."""
    score, refused = outcome.score(), 0
    for truth, given, movements in zip(outcome.truths, outcome.answers, others, strict=True):
        _, wrong = matched(truth, given)
        refused += sum(not any(overlaps(movement, answer) for answer in wrong) for movement in movements)
    return {
        "precision": 100.0 * score.precision,
        "recall": 100.0 * score.recall,
        "false": score.false_per_hour,
        "delay p50": score.delay_s(0.5),
        "delay p95": score.delay_s(0.95),
        "postures": score.events,
        "other movements": sum(map(len, others)),
        "refused": refused,
    }


def session_of(seed: int, minutes: float) -> MotionTimeline:
    """A session of about `minutes` of a person.  seed: of the person and the sequence of movements."""
    rng = np.random.default_rng([0x51, seed])
    subject = person(seed)
    movements: list[tuple[str, int]] = []
    pauses_s: list[float] = []
    while True:
        script = session_timeline(subject, movements, pauses_s, seed)
        if script.duration_s >= 60.0 * minutes:
            return script
        for _ in range(4):
            names = ACTIVITIES if rng.uniform() < UNKNOWN_SHARE else POSTURES
            movements.append((str(rng.choice(names)), REPETITION_FROM + len(movements)))
            pauses_s.append(0.0 if rng.uniform() < NO_PAUSE_SHARE else float(rng.uniform(*PAUSES_S)))


def spans_of(script: MotionTimeline) -> list[PostureSpan]:
    """Movements of a session after the T-pose; the label of a posture is its name."""
    return [
        PostureSpan(segment.name if segment.name in POSTURES else OTHER, segment.start_s, segment.end_s)
        for segment in script.segments
        if segment.name in (*POSTURES, *ACTIVITIES, RETURNING)
    ]


def _rows(method: str, script: MotionTimeline, seed: int) -> Features:
    """Rows of the poses by a method, from the first motion on."""
    with tempfile.TemporaryDirectory() as place:
        found = read_features(session_take(method, script, seed, Path(place)), DEFAULT)
    kept = found.times_s >= script.motion_from_s
    return Features(found.rate, found.times_s[kept], found.features[kept])


STREAM = Kind(
    "stream",
    "Postures, pauses and other movements of simulated people as a stream, with the shipped model, which was trained on "
    "others; three sets of four people, 5 minutes each. Other movements: bend, lean, twist, reach, sit, lunge, gesture, "
    "walking back.",
    run,
    (
        Quantity("precision", "%", 1, "low"),
        Quantity("recall", "%", 1, "low"),
        Quantity("false", "an hour", 0),
        Quantity("delay p50", "s", 2),
        Quantity("delay p95", "s", 2),
        *(Quantity(name, "", 0, joined="sum") for name in ("postures", "other movements", "refused")),
    ),
    {poses: case("stream", poses=poses) for poses in ("two-view", "hybrid", "truth")},
    case("stream", people=1, minutes=0.5),
    rows="poses from",
)
