"""Streams of real motion: movements of the shared motion capture one after another, recognized by models of other takes.

Each model is trained on half of the takes (of motions recorded once: half of their spans) and recognizes a stream of the
other half in random order.  The sword is background of one model and an untrained movement for the other; the broom is the
opposite.  Between two movements, rows are interpolated over BLEND_S.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.cases.recognition.real import MOTIONS, STRIDE_S, UNTRAINED, UNTRAINED_WINDOW_S, real_examples
from benchmarks.cases.recognition.scenario import Event, score_of, sum_of
from benchmarks.cases.recognition.streams import COLUMNS, answers_of, figures
from benchmarks.harness.case import Case, Figures, Kind, case
from zenocap.common.arrays import Floats
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.motion_rows import HEADING, WAY
from zenocap.services.recognizer.stream import stream_setup
from zenocap.services.recognizer.training.example_files import read_features
from zenocap.services.recognizer.training.examples import BACKGROUND, Example, TrainingSettings
from zenocap.services.recognizer.training.train import train

RATE = 60.0  # of the rows of a stream
BLEND_S = 0.5  # between two movements
HALVES = 2


@dataclass(frozen=True)
class Movement:
    """Rows (T, d) at RATE, and the posture of each of `parts` equal parts of them; None: an untrained movement."""

    rows: Floats
    label: str | None
    name: str
    parts: int = 1


def run(one: Case) -> Figures:
    """Figures of one random order of the movements."""
    examples, scores = real_examples(), []
    untrained = [(name, whole(name)) for name in UNTRAINED]
    for half, (tested, trained) in enumerate(halves(examples)):
        known = {example.label for example in trained}
        background = [Example(BACKGROUND, untrained[half][0], "0", RATE, untrained[half][1])]
        setup = stream_setup(train([*trained, *background], TrainingSettings()))
        movements = [
            *movements_of([example for example in tested if example.label in known]),
            *windows(*untrained[1 - half]),
        ]
        shuffled = np.random.default_rng((one.seed, half)).permutation(len(movements))
        rows, events = joined([movements[k] for k in shuffled])
        scores.append(score_of(events, answers_of(setup, rows, RATE), len(rows) / RATE / 60.0))
    return figures(sum_of(scores))


def whole(name: str) -> Floats:
    """All rows of a file, at RATE."""
    motion = read_features(MOTIONS / f"{name}.bvh", DEFAULT)
    return resampled(motion.features, motion.rate)


def halves(examples: Sequence[Example]) -> Iterator[tuple[list[Example], list[Example]]]:
    """Tested examples, and the others for training; every second take or span of each kind is tested in turn."""
    people: dict[str, list[str]] = {}
    for example in examples:
        of = people.setdefault(example.label, [])
        of += [] if example.person in of else [example.person]
    for half in range(HALVES):
        out = {(label, one) for label, of in people.items() if len(of) > 1 for one in of[half::HALVES]}
        yield (
            [example for example in examples if (example.label, example.person) in out],
            [example for example in examples if (example.label, example.person) not in out],
        )


def movements_of(examples: Iterable[Example]) -> Iterator[Movement]:
    """Movements of examples.  Strides of one walk overlap: the walk is one movement of as many whole strides."""
    walks: dict[str, list[Example]] = {}
    for example in examples:
        if example.label == "walk":
            walks.setdefault(example.person, []).append(example)
        else:
            yield Movement(resampled(example.features, example.rate), example.label, example.source)
    for name, strides in walks.items():
        rate = strides[0].rate
        step = round(0.5 * STRIDE_S * rate)
        rows = np.concatenate([*(stride.features[:step] for stride in strides[:-1]), strides[-1].features])
        count = int((len(rows) / rate + 1e-6) // STRIDE_S)
        yield Movement(resampled(rows[: round(count * STRIDE_S * rate)], rate), "walk", name, count)


def windows(name: str, rows: Floats) -> Iterator[Movement]:
    """An untrained movement in windows."""
    edges = range(0, len(rows) + 1, round(UNTRAINED_WINDOW_S * RATE))
    for start, stop in pairwise(edges):
        yield Movement(rows[start:stop], None, name)


def resampled(rows: Floats, rate: float) -> Floats:
    """(T', d) rows at RATE of rows (T, d) at another one, by linear interpolation."""
    times = np.arange(0.0, (len(rows) - 1) / rate + 1e-9, 1.0 / RATE)
    own = np.arange(len(rows)) / rate
    return np.column_stack([np.interp(times, own, column) for column in rows.T])


def joined(movements: Sequence[Movement]) -> tuple[Floats, list[Event]]:
    """Rows (T, d) of movements one after another, each begun where and in the direction in which the last one ended."""
    blend = round(BLEND_S * RATE)
    parts, events, length = list[Floats](), list[Event](), 0
    for movement in movements:
        rows = movement.rows
        if parts:
            last = parts[-1][-1]
            rows = continued(rows, last)
            share = (np.arange(1, blend + 1) / (blend + 1))[:, None]
            between = (1.0 - share) * last + share * rows[0]
            parts.append(between)
            length += blend
        edges = np.linspace(length, length + len(rows), movement.parts + 1) / RATE
        events += [Event(movement.label, start, end, name=movement.name) for start, end in pairwise(edges.tolist())]
        parts.append(rows)
        length += len(rows)
    return np.concatenate(parts), events


def continued(rows: Floats, last: Floats) -> Floats:
    """Rows (T, d) turned and moved so that the first has the place and the heading of another one (d,)."""
    own, wanted = rows[0, HEADING], last[HEADING]
    c, s = float(own @ wanted), float(own[0] * wanted[1] - own[1] * wanted[0])
    turn = np.array([[c, -s], [s, c]]) / np.hypot(c, s)
    out = rows.copy()
    out[:, HEADING] = rows[:, HEADING] @ turn.T
    out[:, WAY] = (rows[:, WAY] - rows[0, WAY]) @ turn.T + last[WAY]
    return out


REAL_STREAM = Kind(
    "real-stream",
    "Motion capture, one movement after another with half a second of interpolated poses between, in three random orders; "
    "two models, each of half of the takes, or of the spans of motions recorded once. The other half is tested; a sword "
    "or a broom are untrained movements.",
    run,
    COLUMNS,
    {"forest": case("motions")},
    case("motions"),
    rows="classifier",
    inputs=lambda _: ("motions",),
)
