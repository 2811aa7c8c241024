"""Rate of false postures that a user asks for, against that in everyday movement of other people, and its cost in recall.

Postures of the people of a seed and everyday movement of BACKGROUND_SEED train a model; its thresholds are set for each
rate; everyday movement of TESTED_SEED is recognized as a stream, and so are the postures of the part stream.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import gammaincinv

from benchmarks.recognition.bench import Bench
from benchmarks.recognition.everyday import everyday_examples
from benchmarks.recognition.scenario import Score, sum_of
from benchmarks.recognition.streaming import answers_of, recognize_session, sessions
from benchmarks.sections import Row, Section, Table
from zenocap.common.errors import UserError
from zenocap.services.recognizer.false_alarms import CONFIDENCE
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.stream import stream_setup
from zenocap.services.recognizer.training.examples import Example, TrainingSettings
from zenocap.services.recognizer.training.rejection_rate import with_rate
from zenocap.services.recognizer.training.train import train
from zenocap.tools.dataset.batch import people
from zenocap.tools.dataset.generate import Method

BACKGROUND_SEED, TESTED_SEED = 13, 14  # persons 156 to 179, who are in no other part
PEOPLE = 12  # of each
# Of each session.  A rate of 1 an hour needs 3 hours of background; true poses alone are cheap enough for that.
MINUTES: dict[Method, float] = {"truth": 17.5, "two-view": 5.0, "hybrid": 2.5}
UNLIMITED = 3600.0  # largest rate allowed: leaves every threshold as it is
RATES = (UNLIMITED, 20.0, 6.0, 1.0)


def false_rate(bench: Bench) -> Section:
    """Section of all methods, a row for each seed of people and rate."""
    rows: list[Row] = []
    for method in bench.poses:
        background, tested = (everyday(bench, method, seed) for seed in (BACKGROUND_SEED, TESTED_SEED))
        hours = hours_of(tested)
        found = sessions(bench, method)
        for seed in range(bench.seeds):
            examples = bench.examples(method, seed, DEFAULT)
            for rate, model in models(examples, background):
                false = sum(false_postures(model, one) for one in tested)
                setup = stream_setup(model)
                score = sum_of([recognize_session(setup, *one).score for one in found])
                rows.append((method, seed, *cells(rate, model, false, hours, score)))
                print(rows[-1], file=sys.stderr, flush=True)
    durations = ", ".join(f"{PEOPLE * MINUTES[method] / 60:g} h ({method})" for method in bench.poses)
    notes = (
        f"Postures of the people of a seed, everyday movement of {PEOPLE} others as background, and of {PEOPLE} further "
        f"people as test: {durations} of each. Rate asked for: `false_per_hour`; none: the usual thresholds. Least share: "
        "of the votes, that a posture then needs. In brackets: 95 % interval of the rate, of a Poisson distribution.",
        f"Recall and precision: of the {bench.minutes:g} minutes of the part stream, whose people are again others.",
    )
    columns = (
        "poses by", "seed", "asked / hour", "least share", "false, background", "limit / hour", "false, tested",
        "false / hour", "recall %", "precision %",
    )  # fmt: skip
    return Section("false-rate", "Rate of false postures", notes, (Table("False postures", columns, tuple(rows)),))


def everyday(bench: Bench, method: Method, seed: int) -> list[Example]:
    """Everyday movement of the people of a seed."""
    found: list[Example] = []
    for number, one in enumerate(people(seed, PEOPLE)):
        found += everyday_examples(bench, method, one, MINUTES[method])
        print(f"{method}, everyday movement of {seed}: {number + 1} of {PEOPLE}", file=sys.stderr, flush=True)
    return found


def models(examples: list[Example], background: list[Example]) -> Iterator[tuple[float, PostureModel]]:
    """Each rate and the model whose thresholds are set for it; rates that cannot be had are left out.

    One training is enough: a rate only raises thresholds.
    """
    model = train([*examples, *background], TrainingSettings(false_per_hour=UNLIMITED))
    assert model.forest is not None
    assert model.forest.alarms is not None
    for rate in RATES:
        try:
            yield rate, replace(model, forest=with_rate(model.forest, model.forest.alarms, rate))
        except UserError as error:
            print(error, file=sys.stderr)


def false_postures(model: PostureModel, movement: Example) -> int:
    """Number of postures that a stream finds in a movement that has none."""
    answers = answers_of(stream_setup(model), movement.features, movement.rate)
    return sum(answer.label is not None for answer in answers)


def hours_of(movements: list[Example]) -> float:
    return sum(len(one.features) / one.rate for one in movements) / 3600.0


def interval(count: int, hours: float) -> tuple[float, float]:
    """Limits (1/h) of the rate of independent events of which `count` were found in `hours`, with CONFIDENCE."""
    outside = 0.5 * (1.0 - CONFIDENCE)
    low = float(gammaincinv(count, outside)) if count else 0.0
    return low / hours, float(gammaincinv(count + 1, 1.0 - outside)) / hours


def cells(rate: float, model: PostureModel, false: int, hours: float, score: Score) -> Row:
    """Cells of a row after those of method and seed."""
    assert model.forest is not None
    alarms = model.forest.alarms
    assert alarms is not None
    low, high = interval(false, hours)
    answered = score.right + score.wrong
    return (
        "none" if rate == UNLIMITED else f"{rate:g}",
        f"{alarms.least:.2f}",
        f"{alarms.count} in {alarms.hours:.2f} h",
        f"{alarms.most_per_hour:.2g}",
        f"{false} in {hours:.2f} h",
        f"{false / hours:.1f} ({low:.1f} to {high:.1f})",
        100.0 * score.right / score.events if score.events else np.nan,
        100.0 * score.right / answered if answered else np.nan,
    )
