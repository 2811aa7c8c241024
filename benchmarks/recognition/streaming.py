"""Minutes of random postures with pauses and unknown movements, recognized as a stream."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.recognition.bench import STREAM_SEED, Bench, Report, code_of
from benchmarks.recognition.scenario import Event, Score, events_of, score_of, session_of, sum_of
from benchmarks.sections import Row, Section, Table
from zenocap.common.arrays import Floats
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.services.recognizer.stream import StreamSetup, finish, initial_stream, push, stream_setup
from zenocap.services.recognizer.training.example_files import read_features
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.tools.dataset.batch import people
from zenocap.tools.dataset.generate import Method, dataset_rig, generate_take

MODEL = "fifteen"
SESSION_MINUTES, MOST_PEOPLE = 2.5, 12  # longer streams have longer sessions: persons beyond are in other sets


@dataclass(frozen=True)
class SessionResult:
    """Answers of a stream to a take, and the true events."""

    events: tuple[Event, ...]
    answers: tuple[Event, ...]
    score: Score


def streaming(bench: Bench) -> Section:
    model = read_model(find_model(MODEL))
    setup = stream_setup(model)
    rows: list[Row] = []
    wrong_answers: list[Row] = []
    for method in bench.poses:
        session_results = [recognize_session(setup, *one) for one in sessions(bench, method)]
        total = sum_of([one.score for one in session_results])
        rows.append((method, *cells(total)))
        wrong_answers += _wrong_answers(method, session_results)
    notes = (
        f"{bench.minutes:g} minutes of {session_count(bench)} people (persons {people(STREAM_SEED)[0]} and after, in no "
        "other part): postures, pauses and untrained movements (bend, lean, twist, reach, sit, lunge, gesture, walking "
        "back), some without a pause between.",
        f"The shipped model {MODEL!r}, trained on other people. An answer is right when it has the label of a posture "
        "and overlaps it by half of the shorter one; delay: from the scripted end to the time of the answer.",
    )
    columns = (
        "poses by", "postures", "precision %", "recall %", "delay p50 s", "delay p95 s", "false / minute",
        "unknown", "unknown with a posture", "misclassified",
    )  # fmt: skip
    tables = (
        Table("Streams", columns, tuple(rows)),
        Table("Wrong answers", ("poses by", "answer", "true movement", "times"), tuple(wrong_answers)),
    )
    return Section("stream", "Streams", notes, tables)


def session_count(bench: Bench) -> int:
    """Number of sessions, each by another person."""
    return min(MOST_PEOPLE, math.ceil(bench.minutes / SESSION_MINUTES))


def sessions(bench: Bench, method: Method) -> list[tuple[Path, MotionTimeline]]:
    """Takes of the sessions, and what happens in them."""
    count = session_count(bench)
    folder = bench.out / "acted" / f"{method}-sessions-{bench.minutes:g}-{code_of(method)}"
    folder.mkdir(parents=True, exist_ok=True)
    report, rig, found = Report(f"{method}, sessions", 1), dataset_rig(method), []
    for done, seed in enumerate(people(STREAM_SEED, count)):
        take, script = folder / f"{seed}.mcap", session_of(seed, bench.minutes / count)
        if not take.is_file():
            part = take.with_suffix(f".{os.getpid()}.part")
            generate_take(rig, method, script, seed, part)
            part.replace(take)
        found.append((take, script))
        report(done + 1, count, "")
    return found


def recognize_session(setup: StreamSetup, take: Path, script: MotionTimeline) -> SessionResult:
    """Answers to the take of a person's session."""
    motion = read_features(take, setup.kind)
    stream = initial_stream(setup)
    answers = []
    for time_s, row in zip(motion.times_s, motion.features, strict=True):
        if time_s < script.motion_from_s:
            continue
        stream, answer, _ = push(setup, stream, round(time_s * 1e9), row)
        if answer is not None:
            answers.append(Event(answer.label, answer.start_ns / 1e9, answer.end_ns / 1e9, float(time_s)))
    events = events_of(script)
    minutes = (script.duration_s - script.motion_from_s) / 60.0
    return SessionResult(tuple(events), tuple(answers), score_of(events, answers, minutes))


def answers_of(setup: StreamSetup, rows: Floats, rate: float) -> list[Event]:
    """Answers to rows (T, d) at a rate, without gaps; the last ones at their end."""
    stream, answers = initial_stream(setup), list[Event]()
    for k, row in enumerate(rows):
        stream, answer, _ = push(setup, stream, round(k * 1e9 / rate), row)
        if answer is not None:
            answers.append(Event(answer.label, answer.start_ns / 1e9, answer.end_ns / 1e9, k / rate))
    ends = finish(setup, stream)
    return answers + [Event(one.label, one.start_ns / 1e9, one.end_ns / 1e9, len(rows) / rate) for one in ends]


def cells(score: Score) -> Row:
    """Cells of the table of streams, after the first column."""
    delays = np.array(score.delays_s) if score.delays_s else np.array([np.nan])
    p50, p95 = (f"{value:.2f}" for value in np.quantile(delays, (0.5, 0.95)))
    answered = score.right + score.wrong
    precision = 100.0 * score.right / answered if answered else float("nan")
    recall = 100.0 * score.right / score.events if score.events else float("nan")
    false = f"{score.wrong / score.minutes:.2f}"
    return score.events, precision, recall, p50, p95, false, score.unknown, score.unknown_wrong, score.known_wrong


def _wrong_answers(method: Method, session_results: list[SessionResult]) -> list[Row]:
    counts: dict[tuple[str, str], int] = {}
    for one in session_results:
        for answer in one.answers:
            overlapping = [
                event for event in one.events if min(event.end_s, answer.end_s) > max(event.start_s, answer.start_s)
            ]
            names = " + ".join(event.name for event in overlapping) or "nothing"
            if answer.label is not None and answer.label not in names.split(" + "):
                counts[answer.label, names] = counts.get((answer.label, names), 0) + 1
    return [(method, *pair, count) for pair, count in sorted(counts.items(), key=lambda item: (-item[1], item[0]))]
