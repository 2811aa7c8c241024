"""Accuracy by the number of people who give one example of each posture, on the others."""

import numpy as np

from benchmarks.recognition.bench import Bench
from benchmarks.sections import Row, Section, Table
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.training.cross_validation import classifier_of
from zenocap.services.recognizer.training.examples import CLASSIFIERS, Example, TrainingSettings, prepare

PEOPLE_SEED, DRAWS = 0, 5
NUMBERS = (1, 2, 3, 5, 10)


def few(bench: Bench) -> Section:
    """Section of all methods."""
    rows: list[Row] = []
    for method in bench.poses:
        examples = bench.examples(method, PEOPLE_SEED, DEFAULT)
        for classifier in CLASSIFIERS:
            settings = TrainingSettings(classifier=classifier)
            rows.append((method, classifier, *(_shares(examples, settings, number) for number in NUMBERS)))
    notes = (
        f"People of seed {PEOPLE_SEED}. One example of each posture by each of some people, {DRAWS} draws of people; all "
        "examples of the others are tested, and the likeliest posture counts. Mean (worst draw), %.",
    )
    columns = ("poses by", "classifier", *(str(number) for number in NUMBERS))
    return Section("few", "Few examples", notes, (Table("Recognized by number of people", columns, tuple(rows)),))


def _shares(examples: list[Example], settings: TrainingSettings, number: int) -> str:
    people = sorted({example.person for example in examples})
    shares = []
    for draw in range(DRAWS):
        chosen = set(np.random.default_rng((draw, number)).permutation(people)[:number].tolist())
        first: dict[tuple[str, str], Example] = {}
        for example in examples:
            if example.person in chosen:
                first.setdefault((example.label, example.person), example)
        training = prepare(list(first.values()), settings)
        classify = classifier_of(training, settings)
        tested = prepare([one for one in examples if one.person not in chosen and one.label in training.labels], settings)
        right = [
            training.labels[classify(rows).best] == example.label
            for rows, example in zip(tested.sequences, tested.examples, strict=True)
        ]
        shares.append(100.0 * float(np.mean(right)))
    return f"{np.mean(shares):.1f} ({min(shares):.1f})"
