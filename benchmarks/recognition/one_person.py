"""Accuracy by the number of examples of each posture that one person gives, on that person's others and on other people.

As a designer teaches: one take of one person, with a pause before every posture.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.recognition.bench import Bench, Report, code_of
from benchmarks.sections import Row, Section, Table
from zenocap.common.errors import UserError
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.training.cross_validation import classifier_of
from zenocap.services.recognizer.training.example_files import examples_of
from zenocap.services.recognizer.training.examples import Example, TrainingSettings, prepare
from zenocap.services.recognizer.training.manifest import Row as ManifestRow
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline, session_timeline
from zenocap.tools.dataset.batch import people
from zenocap.tools.dataset.generate import Method, dataset_rig, generate_take

PEOPLE_SEED = 11  # persons 132 and after, who are in no other part
PEOPLE: dict[Method, int] = {"truth": 6, "hybrid": 2}
NUMBERS = (1, 2, 3, 5, 10)
TESTED = 2  # the last repetitions of each posture
REPETITIONS = max(NUMBERS) + TESTED
DRAWS = 3
PAUSES_S = (0.5, 1.5)
FEW_POSTURES = 3  # of the smaller set, drawn anew for every draw


def one_person(bench: Bench) -> Section:
    """Section of all methods."""
    rows: list[Row] = []
    for method, count in PEOPLE.items():
        found = {seed: session_examples(bench, method, seed) for seed in people(PEOPLE_SEED, count)}
        for postures in (FEW_POSTURES, len(POSTURES)):
            by_number = [_shares(found, TrainingSettings(), number, postures) for number in NUMBERS]
            for tested, cells in zip(("the same person", "other people"), zip(*by_number, strict=True), strict=True):
                rows.append((method, postures, tested, *cells))
                print(rows[-1], file=sys.stderr, flush=True)
    counts = ", ".join(f"{count} ({method})" for method, count in PEOPLE.items())
    notes = (
        f"People of seed {PEOPLE_SEED}: {counts}. Each performs fifteen postures {REPETITIONS} times in one take, with "
        f"pauses. A number of the first {max(NUMBERS)} repetitions of each posture by one of them is learnt, of "
        f"{FEW_POSTURES} random postures or of all fifteen, {DRAWS} draws for each person; the last {TESTED} repetitions "
        "are tested, of the same person and of the others, and the likeliest posture of the default classifier counts. "
        "Mean (worst draw), %.",
    )
    columns = ("poses by", "postures", "tested", *(str(number) for number in NUMBERS))
    return Section("one-person", "Examples of one person", notes, (Table("Recognized", columns, tuple(rows)),))


def session_of(seed: int) -> MotionTimeline:
    """Every posture REPETITIONS times, in rounds of random order."""
    rng = np.random.default_rng([0x17, seed])
    movements = [(str(name), round_) for round_ in range(REPETITIONS) for name in rng.permutation(POSTURES)]
    pauses_s = rng.uniform(*PAUSES_S, len(movements)).tolist()
    return session_timeline(person(seed), movements, pauses_s, seed)


def session_examples(bench: Bench, method: Method, seed: int) -> list[Example]:
    """Examples of a person's session; those without poses throughout are left out."""
    folder = bench.out / "acted" / f"{method}-one-person-{code_of(method)}"
    folder.mkdir(parents=True, exist_ok=True)
    take, timeline = folder / f"{seed}.mcap", session_of(seed)
    if not take.is_file():
        part = take.with_suffix(f".{os.getpid()}.part")
        generate_take(dataset_rig(method), method, timeline, seed, part)
        part.replace(take)
    Report(f"{method}, one person", 1)(seed - people(PEOPLE_SEED)[0] + 1, PEOPLE[method], "")
    missing: list[str] = []
    try:
        found = examples_of(take, session_rows(take, timeline, seed), DEFAULT, missing=missing)
    except UserError as error:
        missing, found = [str(error)], []
    for line in missing:
        print(line, file=sys.stderr)
    return found


def session_rows(take: Path, timeline: MotionTimeline, seed: int) -> list[ManifestRow]:
    """A row for each posture of a session."""
    counts = dict.fromkeys(POSTURES, 0)
    rows = []
    for segment in timeline.segments:
        if segment.name in counts:
            span = (segment.start_s, segment.end_s)
            rows.append(ManifestRow(0, take, *span, segment.name, str(seed), str(counts[segment.name])))
            counts[segment.name] += 1
    return rows


def _shares(found: dict[int, list[Example]], settings: TrainingSettings, number: int, postures: int) -> list[str]:
    """Mean and worst share of right answers, %: of the same person, and of the others."""
    shares: list[tuple[float, float]] = []
    for draw in range(DRAWS):
        for seed, own in found.items():
            rng = np.random.default_rng((draw, number, seed))
            wanted = set(rng.permutation(POSTURES)[:postures].tolist())
            training = prepare(drawn(own, wanted, number, rng), settings)
            classify = classifier_of(training, settings)
            right: dict[bool, list[bool]] = {True: [], False: []}
            for other, examples in found.items():
                asked = [one for one in examples if one.label in wanted and int(one.repetition) >= max(NUMBERS)]
                ready = prepare(asked, settings)
                for rows, one in zip(ready.sequences, ready.examples, strict=True):
                    right[other == seed].append(training.labels[classify(rows).best] == one.label)
            shares.append((100.0 * float(np.mean(right[True])), 100.0 * float(np.mean(right[False]))))
    return [f"{np.mean(column):.1f} ({min(column):.1f})" for column in zip(*shares, strict=True)]


def drawn(own: Sequence[Example], wanted: set[str], number: int, rng: np.random.Generator) -> list[Example]:
    """`number` of the first repetitions of each wanted posture."""
    found = []
    for label in POSTURES:
        if label in wanted:
            first = [one for one in own if one.label == label and int(one.repetition) < max(NUMBERS)]
            found += [first[k] for k in sorted(rng.permutation(len(first))[:number].tolist())]
    return found
