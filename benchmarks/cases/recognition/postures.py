"""Postures of simulated people by people, protocol, classifier and number of examples.  [Two-view 5]"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.cases.recognition.examples import posture_examples, session_examples
from benchmarks.harness.case import Case, Column, Figures, Kind, case
from benchmarks.people.films import size_of
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.features import Kind as Features
from zenocap.services.recognizer.training.cross_validation import PROTOCOLS, Protocol, classifier_of, cross_validate
from zenocap.services.recognizer.training.examples import (
    CLASSIFIERS,
    Classifier,
    Example,
    Topology,
    TrainingSettings,
    prepare,
)  # fmt: skip
from zenocap.services.recognizer.training.manifest import Row
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline, session_timeline
from zenocap.tools.dataset.batch import PEOPLE, REPETITIONS, people

# Paper (replaced): [Two-view 5] has twelve people before two cameras; here simulated people.
PAPER = (22, 21, 23, 21, 24, 20, 23, 24, 22, 22, 23, 24, 21, 22, 20)  # Table 2, of 24 for each posture
PAPER_FEATURES: Features = "joint-angles"
TOPOLOGIES = ("left-right", "ergodic")  # 5.1: left-right; Fig. 15 has transitions back as well
NO_SMOOTHING = 1e-6  # the smallest floor: without it one unknown symbol makes every model impossible
POSES = ("two-view", "hybrid", "truth")
NUMBERS = (1, 2, 3, 5, 10)
DESIGNERS, DESIGNER_SEED = 6, 11  # persons 132 and after, who are in no other part
TESTED = 2  # the last repetitions of each posture
PAUSES_S = (0.5, 1.5)
FEW_POSTURES = 3  # of the smaller set, drawn for every draw


def run(one: Case) -> Figures:
    """Recognized postures of a seed's people.  Options: poses, classifier, protocol, size, people, topology."""
    count = one.option("people", PEOPLE)
    size = one.option("size", "")
    settings, features = _settings(one)
    found = posture_examples(one.option("poses", "truth"), one.seed, features, count, size_of(size) if size else None)
    outcome = cross_validate(found, settings, cast(Protocol, one.option("protocol", "subjects")))
    performed = count * len(POSTURES) * REPETITIONS
    return {"recognized": 100.0 * outcome.right / performed, "right": outcome.right, "performed": performed}


def _settings(one: Case) -> tuple[TrainingSettings, Features]:
    """Settings, and the features; with `topology` those of the paper's configuration."""
    topology = one.option("topology", "")
    if not topology:
        return TrainingSettings(classifier=cast(Classifier, one.option("classifier", "forest"))), DEFAULT
    chosen = cast(Topology, topology)
    plain = TrainingSettings(classifier="paper", features=PAPER_FEATURES, topology=chosen, folds=0)
    return replace(plain, floor=NO_SMOOTHING, spread=0.0), PAPER_FEATURES


def run_confusions(one: Case) -> Figures:
    """How often a performed posture, the film, was recognized as each one, in the paper's configuration."""
    settings, features = _settings(one.with_options(topology=TOPOLOGIES[0]))
    found = posture_examples("two-view-paper", one.seed, features, one.option("people", PEOPLE))
    outcome = cross_validate(found, settings, "paper")
    counts = dict.fromkeys(range(len(POSTURES)), 0)
    for answer in outcome.answers:
        if outcome.labels[answer.true] == one.film:
            counts[POSTURES.index(outcome.labels[answer.given])] += 1
    named = {str(number + 1): float(count) for number, count in counts.items() if count}
    return named | {"paper": PAPER[POSTURES.index(one.film)]}


def run_few(one: Case) -> Figures:
    """Share recognized of all other people's, with one example of each posture by each of some people, one draw.

    Options: poses, classifier, number.
    """
    number = one.option("number", 1)
    settings = TrainingSettings(classifier=cast(Classifier, one.option("classifier", "forest")))
    examples = posture_examples(one.option("poses", "truth"), 0, count=one.option("people", PEOPLE))
    who = sorted({example.person for example in examples})
    chosen = set(np.random.default_rng((one.seed, number)).permutation(who)[:number].tolist())
    first: dict[tuple[str, str], Example] = {}
    for example in examples:
        if example.person in chosen:
            first.setdefault((example.label, example.person), example)
    training = prepare(list(first.values()), settings)
    tested = prepare([each for each in examples if each.person not in chosen and each.label in training.labels], settings)
    classify = classifier_of(training, settings)
    right = [
        training.labels[classify(rows).best] == example.label
        for rows, example in zip(tested.sequences, tested.examples, strict=True)
    ]
    return {"recognized": 100.0 * float(np.mean(right))}


def run_one_person(one: Case) -> Figures:
    """Share recognized with some examples of each posture by one person, one draw for each of six people.

    Options: number, postures (of the set), designers.
    """
    number, postures = one.option("number", 1), one.option("postures", len(POSTURES))
    designers = people(DESIGNER_SEED, one.option("designers", DESIGNERS))
    found = {
        seed: session_examples("truth", session := session_of(seed), seed, session_rows(session, seed))
        for seed in designers
    }
    shares: dict[str, list[float]] = {"the same person": [], "other people": []}
    for seed, own in found.items():
        rng = np.random.default_rng((one.seed, number, seed))
        wanted = set(rng.permutation(POSTURES)[:postures].tolist())
        training = prepare(_drawn(own, wanted, number, rng), TrainingSettings())
        classify = classifier_of(training, TrainingSettings())
        right: dict[str, list[bool]] = {name: [] for name in shares}
        for other, examples in found.items():
            asked = [each for each in examples if each.label in wanted and int(each.repetition) >= max(NUMBERS)]
            ready = prepare(asked, TrainingSettings())
            for rows, each in zip(ready.sequences, ready.examples, strict=True):
                name = "the same person" if other == seed else "other people"
                right[name].append(training.labels[classify(rows).best] == each.label)
        for name, some in right.items():
            shares[name] += [100.0 * float(np.mean(some))] if some else []
    return {name: float(np.mean(values)) for name, values in shares.items() if values} | {
        f"{name}, worst": min(values) for name, values in shares.items() if values
    }


def session_of(seed: int) -> MotionTimeline:
    """Every posture as often as is needed, in rounds of random order."""
    rng = np.random.default_rng([0x17, seed])
    movements = [(str(name), round_) for round_ in range(max(NUMBERS) + TESTED) for name in rng.permutation(POSTURES)]
    pauses_s = rng.uniform(*PAUSES_S, len(movements)).tolist()
    return session_timeline(person(seed), movements, pauses_s, seed)


def session_rows(timeline: MotionTimeline, seed: int) -> list[Row]:
    """A row for each posture of a session."""
    counts = dict.fromkeys(POSTURES, 0)
    rows = []
    for segment in timeline.segments:
        if segment.name in counts:
            number = str(counts[segment.name])
            rows.append(Row(0, Path(), segment.start_s, segment.end_s, segment.name, str(seed), number))
            counts[segment.name] += 1
    return rows


def _drawn(own: Sequence[Example], wanted: set[str], number: int, rng: np.random.Generator) -> list[Example]:
    """`number` of the first repetitions of each wanted posture."""
    found = []
    for label in POSTURES:
        if label in wanted:
            first = [one for one in own if one.label == label and int(one.repetition) < max(NUMBERS)]
            found += [first[k] for k in sorted(rng.permutation(len(first))[:number].tolist())]
    return found


SHARE = Column("recognized", "%", 1, "low")
RIGHT = (SHARE, Column("right", "", 0, "low"), Column("performed", "", 0, ""))
POSTURES_KIND = Kind(
    "postures",
    "Postures recognized: sets of twelve simulated people, fifteen postures, two repetitions, everything from the video; "
    "none of them was used to choose settings. A take without a pose counts as wrong.",
    run,
    RIGHT,
    {
        f"{poses}, {classifier}, {name}": case("postures", poses=poses, classifier=classifier, protocol=protocol)
        for poses in POSES
        for classifier in CLASSIFIERS
        for protocol, name in zip(PROTOCOLS, ("the paper's protocol", "other people"), strict=True)
    }
    | {
        f"hybrid, two cameras, {size}, {name}": case(
            "postures", poses="hybrid-two-view", classifier="paper", protocol=protocol, size=size, people=4
        )
        for size in ("160x120", "640x480")
        for protocol, name in zip(PROTOCOLS, ("the paper's protocol", "other people"), strict=True)
    },
    case("postures", people=3),
    rows="poses from, classifier, protocol",
)
AS_IN_THE_PAPER = Kind(
    "postures-paper",
    "[Two-view Table 2] in the paper's configuration: ten joint angles, 64 symbols, five states, emissions as trained, no "
    "rejection; of two repetitions by every person one trains and the other is tested, in turn.",
    run,
    RIGHT,
    {
        f"variant {variant}, {topology}": case("postures", poses=poses, protocol="paper", topology=topology)
        for variant, poses in (("paper", "two-view-paper"), ("improved", "two-view"))
        for topology in TOPOLOGIES
    },
    case("postures", protocol="paper", topology="ergodic", people=3),
    rows="poses from, models",
)
CONFUSIONS = Kind(
    "confusions",
    "[Two-view Table 2] in the paper's configuration, variant `paper`, left-right models: a row a performed posture, a "
    "column a recognized one, in the same order; the last one is the number right in the paper, of 24. One set of people.",
    run_confusions,
    (*(Column(str(number + 1), "", 0, "") for number in range(len(POSTURES))), Column("paper", "", 0, "")),
    {f"{number + 1} {posture}": case(posture) for number, posture in enumerate(POSTURES)},
    case(POSTURES[2], people=3),
    seeds=1,
    rows="performed",
)
FEW = Kind(
    "few-examples",
    "One example of each posture by each of some people, tested on the others; five draws of people.",
    run_few,
    (SHARE,),
    {
        f"{poses}, {classifier}, {number} people": case("few", poses=poses, classifier=classifier, number=number)
        for poses in POSES
        for classifier in CLASSIFIERS
        for number in NUMBERS
    },
    case("few", number=2, people=3),
    seeds=5,
    rows="poses from, classifier, people",
)
ONE_PERSON = Kind(
    "one-person",
    "Some examples of each posture by one person, tested on later ones of that person and on other people; six simulated "
    "people, true angles, three draws.",
    run_one_person,
    tuple(
        Column(f"{who}{worst}", "%", 1, "low") for who in ("the same person", "other people") for worst in ("", ", worst")
    ),
    {
        f"{postures} postures, {number} examples": case("one person", postures=postures, number=number)
        for postures in (FEW_POSTURES, len(POSTURES))
        for number in NUMBERS
    },
    case("one person", postures=FEW_POSTURES, designers=2),
    rows="postures, examples",
)
