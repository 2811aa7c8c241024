"""Rate of false postures that a user asks for, against that in everyday movement of other people, and its cost in recall.

Postures of the people of a seed and everyday movement of BACKGROUND_SEED train a model; its thresholds are set for the
rate; everyday movement of TESTED_SEED is recognized as a stream, and so are sessions of postures.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

from scipy.special import gammaincinv

from benchmarks.cases.recognition.everyday import everyday_examples
from benchmarks.cases.recognition.examples import posture_examples
from benchmarks.cases.recognition.scenario import sum_of
from benchmarks.cases.recognition.streams import answers_of, recognized_session, sessions
from benchmarks.harness.case import Case, Column, Figures, Kind, case
from zenocap.common.errors import UserError
from zenocap.services.recognizer.false_alarms import CONFIDENCE
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.stream import stream_setup
from zenocap.services.recognizer.training.examples import Example, TrainingSettings
from zenocap.services.recognizer.training.rejection_rate import with_rate
from zenocap.services.recognizer.training.train import train
from zenocap.tools.dataset.batch import PEOPLE, people

BACKGROUND_SEED, TESTED_SEED = 13, 14  # persons 156 to 179, who are in no other part
# Of each session.  A rate of 1 an hour needs 3 hours of background; true poses alone are cheap enough for that.
MINUTES = {"truth": 17.5, "two-view": 5.0, "hybrid": 2.5}
UNLIMITED = 3600.0  # largest rate allowed: leaves every threshold as it is
RATES = (UNLIMITED, 20.0, 6.0, 1.0)


def run(one: Case) -> Figures:
    """False postures an hour, and recall.  Options: poses, rate (an hour), people and minutes of each."""
    method, rate, count = one.option("poses", "truth"), one.option("rate", UNLIMITED), one.option("people", PEOPLE)
    minutes = one.option("minutes", MINUTES[method])
    background, tested = (
        [each for who in people(seed, count) for each in everyday_examples(method, who, minutes)]
        for seed in (BACKGROUND_SEED, TESTED_SEED)
    )
    found = dict(models(posture_examples(method, one.seed, count=count), background, (rate,)))
    if rate not in found:
        return {}
    model, hours = found[rate], hours_of(tested)
    false = sum(false_postures(model, each) for each in tested)
    low, high = interval(false, hours)
    setup = stream_setup(model)
    score = sum_of([recognized_session(setup, each).score for each in sessions(method, 0, 1, one.option("stream", 2.5))])
    return {
        "false": false / hours,
        "at least": low,
        "at most": high,
        "hours": hours,
        "recall": 100.0 * score.right / max(score.events, 1),
    }


def models(
    examples: Sequence[Example], background: Sequence[Example], rates: Sequence[float] = RATES
) -> Iterator[tuple[float, PostureModel]]:
    """Each rate and the model whose thresholds are set for it; rates that cannot be had are left out.

    One training is enough: a rate only raises thresholds.
    """
    model = train([*examples, *background], TrainingSettings(false_per_hour=UNLIMITED))
    assert model.forest is not None
    assert model.forest.alarms is not None
    for rate in rates:
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


FALSE_RATE = Kind(
    "false-rate",
    "False postures an hour in everyday movement of people outside of the background, by the rate that was asked for, "
    "with the 95 % interval of a Poisson rate, and the recall in a stream of postures.",
    run,
    (
        Column("false", "an hour"),
        Column("at least", "an hour", 1, ""),
        Column("at most", "an hour"),
        Column("hours", "h", 1, ""),
        Column("recall", "%", 0, "low"),
    ),
    {
        f"truth, {name}": case("everyday", rate=rate)
        for name, rate in (("no rate", UNLIMITED), ("20 an hour", 20.0), ("6 an hour", 6.0), ("1 an hour", 1.0))
    },
    case("everyday", people=3, minutes=1.0, stream=0.5),
    rows="poses from, rate",
)
