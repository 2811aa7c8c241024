"""Postures of simulated people by people, protocol, classifier and number of examples.  [Two-view 5]"""

from dataclasses import replace
from typing import cast

import numpy as np

from benchmarks.cases.recognition.examples import posture_examples
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import size_of
from zenocap.services.recognizer.features import DEFAULT, NAMES
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
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.tools.teach.dataset.batch import PEOPLE, REPETITIONS

# Paper (replaced): [Two-view 5] has twelve people before two cameras; here simulated people.
PAPER = (22, 21, 23, 21, 24, 20, 23, 24, 22, 22, 23, 24, 21, 22, 20)  # Table 2, of 24 for each posture
PAPER_FEATURES: Features = "joint-angles"
TOPOLOGIES = ("left-right", "ergodic")  # 5.1: left-right; Fig. 15 has transitions back as well
NO_SMOOTHING = 1e-6  # the smallest floor: without it one unknown symbol makes every model impossible
POSES = ("two-view", "hybrid", "truth")
NUMBERS = (1, 2, 3, 5, 10)
LIMBS = {f"{side} {limb}": NAMES.index(f"{side}_{joint}.x") for limb, joint in (("arm", "shoulder"), ("leg", "hip"))
         for side in ("right", "left")}  # the first of two angles  # fmt: skip


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
    """How often a performed posture, the film, was recognized as each one, in the paper's configuration.

    Options: poses, people.
    """
    settings, features = _settings(one.with_options(topology=TOPOLOGIES[0]))
    found = posture_examples(one.option("poses", "two-view-paper"), one.seed, features, one.option("people", PEOPLE))
    outcome = cross_validate(found, settings, "paper")
    counts = dict.fromkeys(range(len(POSTURES)), 0)
    for answer in outcome.answers:
        if outcome.labels[answer.true] == one.film:
            counts[POSTURES.index(outcome.labels[answer.given])] += 1
    named = {str(number + 1): float(count) for number, count in counts.items() if count}
    return named | {"paper": PAPER[POSTURES.index(one.film)]}


def run_ranges(one: Case) -> Figures:
    """Range of each limb's angle that moves most in a posture, the film, 5th to 95th percentile: median of all takes.

    Options: poses, people.
    """
    found: dict[str, float] = {}
    for name, poses in (("", one.option("poses", "two-view-paper")), (", true", "truth")):
        examples = posture_examples(poses, one.seed, PAPER_FEATURES, one.option("people", PEOPLE))
        angles = [example.features[:, : len(NAMES)] for example in examples if example.label == one.film]
        ranges = [np.diff(np.nanpercentile(rows, (5.0, 95.0), axis=0), axis=0)[0] for rows in angles]
        median = np.degrees(np.median(ranges, axis=0))
        found |= {limb + name: float(median[first : first + 2].max()) for limb, first in LIMBS.items()}
    return found


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


SHARE = Quantity("recognized", "%", 1, "low")
RIGHT = (SHARE, Quantity("right", "", 0, "low"), Quantity("performed", "", 0, ""))
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
    case("postures", people=2),
    rows="poses from, classifier, protocol",
)
AS_IN_THE_PAPER = Kind(
    "postures-paper",
    "[Two-view Table 2] in the paper's configuration: ten joint angles, 64 symbols, five states, emissions as trained, no "
    "rejection; of two repetitions by every person one trains and the other is tested, in turn.",
    run,
    RIGHT,
    {
        f"{name}, {topology}": case("postures", poses=poses, protocol="paper", topology=topology)
        for name, poses in (("variant paper", "two-view-paper"), ("variant improved", "two-view"), ("true angles", "truth"))
        for topology in TOPOLOGIES
    },
    case("postures", protocol="paper", topology="ergodic", people=2),
    rows="poses from, models",
)
CONFUSIONS = Kind(
    "confusions",
    "[Two-view Table 2] in the paper's configuration, variant `paper`, left-right models: a row a performed posture, a "
    "column a recognized one, in the same order; the last one is the number right in the paper, of 24. One set of people.",
    run_confusions,
    (*(Quantity(str(number + 1), "", 0, "") for number in range(len(POSTURES))), Quantity("paper", "", 0, "")),
    {f"{number + 1} {posture}": case(posture) for number, posture in enumerate(POSTURES)},
    case(POSTURES[2], poses="truth", people=2),
    seeds=1,
    rows="performed",
)
RANGES = Kind(
    "posture-ranges",
    "Cause of the confusions: how far each limb moves in a posture, by variant `paper` and in truth: the larger range of "
    "its two angles, shoulder or hip, 5th to 95th percentile of a take; median of the takes of one set of people.",
    run_ranges,
    tuple(Quantity(limb + name, "°", 0, "") for limb in LIMBS for name in ("", ", true")),
    {name: case(one.film) for name, one in CONFUSIONS.cases.items()},
    case(POSTURES[2], poses="truth", people=1),
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
