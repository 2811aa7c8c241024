"""Ten minutes of random postures with pauses and unknown movements, recognised as a stream."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from services.recognizer.file import find_model, read_model
from services.recognizer.reading import features_in
from services.recognizer.stream import Plan, beginning, heard, plan_of
from services.takes.act.cast import people
from services.takes.act.stage import Method, act, stage
from tests.evaluation.recognition.bench import STREAM_SEED, Bench, Report, code_of
from tests.evaluation.recognition.scenario import Event, Score, events_of, score_of, session_of, together
from tests.evaluation.sections import Row, Section, Table

MODEL = "fifteen"
METHODS: tuple[Method, ...] = ("truth", "two-view", "hybrid")
MINUTES, SESSIONS = 10.0, 4


@dataclass(frozen=True)
class Streamed:
    """What a stream said of a take, and what really happened."""

    events: tuple[Event, ...]
    answers: tuple[Event, ...]
    score: Score


def streaming(bench: Bench) -> Section:
    model = read_model(find_model(MODEL))
    plan = plan_of(model)
    rows: list[Row] = []
    mistakes: list[Row] = []
    for method in METHODS:
        each = [streamed(plan, take, seed) for seed, take in sessions(bench, method).items()]
        total = together([one.score for one in each])
        rows.append((method, *cells(total)))
        mistakes += _mistakes(method, each)
    notes = (
        f"{MINUTES:g} minutes of {SESSIONS} people (persons {people(STREAM_SEED)[0]} and after, in no other part): "
        "postures, pauses and movements that are none of them (bend, lean, twist, reach, sit, lunge, gesture, walking "
        "back), some without a pause between.",
        f"The model {MODEL!r} as it ships, learnt from other people. An answer is right when it names the posture and "
        "shares half of the shorter of both; delay: from the end in the script until the instant that gave the answer.",
    )
    columns = (
        "poses by", "postures", "precision %", "recall %", "delay p50 s", "delay p95 s", "false / minute",
        "unknown", "taken for a posture", "taken for another",
    )  # fmt: skip
    tables = (
        Table("Streams", columns, tuple(rows)),
        Table("Wrong answers", ("poses by", "answer", "really", "times"), tuple(mistakes)),
    )
    return Section("stream", "Streams", notes, tables)


def sessions(bench: Bench, method: Method) -> dict[int, Path]:
    """Takes of the sessions by the seed of their person."""
    folder = bench.out / "acted" / f"{method}-sessions-{code_of(method)}"
    folder.mkdir(parents=True, exist_ok=True)
    report, rig, found = Report(f"{method}, sessions", 1), stage(method), {}
    for done, seed in enumerate(people(STREAM_SEED, SESSIONS)):
        take = folder / f"{seed}.mcap"
        if not take.is_file():
            part = take.with_suffix(f".{os.getpid()}.part")
            act(rig, method, session_of(seed, MINUTES / SESSIONS), seed, part)
            part.replace(take)
        found[seed] = take
        report(done + 1, SESSIONS, "")
    return found


def streamed(plan: Plan, take: Path, seed: int) -> Streamed:
    """The answers to a take of the session of a person."""
    script = session_of(seed, MINUTES / SESSIONS)
    motion = features_in(take, plan.kind)
    stream = beginning(plan)
    answers = []
    for time_s, row in zip(motion.times_s, motion.features, strict=True):
        if time_s < script.motion_from_s:
            continue
        stream, answer, _ = heard(plan, stream, round(time_s * 1e9), row)
        if answer is not None:
            answers.append(Event(answer.label, answer.start_ns / 1e9, answer.end_ns / 1e9, float(time_s)))
    events = events_of(script)
    minutes = (script.duration_s - script.motion_from_s) / 60.0
    return Streamed(tuple(events), tuple(answers), score_of(events, answers, minutes))


def cells(score: Score) -> Row:
    """Of the table of streams, after the first column."""
    delays = np.array(score.delays_s) if score.delays_s else np.array([np.nan])
    p50, p95 = (f"{value:.2f}" for value in np.quantile(delays, (0.5, 0.95)))
    said = score.right + score.wrong
    precision = 100.0 * score.right / said if said else float("nan")
    recall = 100.0 * score.right / score.events if score.events else float("nan")
    false = f"{score.wrong / score.minutes:.2f}"
    return score.events, precision, recall, p50, p95, false, score.unknown, score.taken, score.known_wrong


def _mistakes(method: Method, each: list[Streamed]) -> list[Row]:
    counts: dict[tuple[str, str], int] = {}
    for one in each:
        for answer in one.answers:
            about = [event for event in one.events if min(event.end_s, answer.end_s) > max(event.start_s, answer.start_s)]
            names = " + ".join(event.name for event in about) or "nothing"
            if answer.label is not None and answer.label not in names.split(" + "):
                counts[answer.label, names] = counts.get((answer.label, names), 0) + 1
    return [(method, *pair, count) for pair, count in sorted(counts.items(), key=lambda item: (-item[1], item[0]))]
