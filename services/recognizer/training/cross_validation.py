"""Cross-validation of recognition on held-out examples, by two protocols.  [Two-view 5.2]

`paper`: every person is in the training and the test set, with different repetitions of each posture.  `subjects`: tested
people are not in the training set.  As in the paper, the result is the likeliest posture, whatever its score.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.errors import UserError
from zenocap.services.recognizer.model import Classification, by_forest, classify
from zenocap.services.recognizer.segment_description import VALUES, describe
from zenocap.services.recognizer.training.examples import Example, Prepared, TrainingSettings, postures_of, prepare
from zenocap.services.recognizer.training.forest import descriptions_of, train_forest
from zenocap.services.recognizer.training.train import Report, no_report, train_models

# Paper (open): 5.2 does not state whether tested people are in training; here one protocol for each reading.
Protocol = Literal["paper", "subjects"]
PROTOCOLS: tuple[Protocol, ...] = get_args(Protocol)
HALVES = 2


@dataclass(frozen=True)
class HeldOutResult:
    """Result of one held-out example.

    example: index.  true, given: indices of labels.  margin: log-likelihood, or logarithm of votes, of `true` minus the
    largest other.
    """

    example: int
    true: int
    given: int
    margin: float


@dataclass(frozen=True)
class ValidationOutcome:
    """Results by one protocol.  people: their number.  answers: one per example that could be tested, in order."""

    protocol: Protocol
    labels: tuple[str, ...]
    people: int
    answers: tuple[HeldOutResult, ...]

    @property
    def right(self) -> int:
        return sum(answer.true == answer.given for answer in self.answers)

    @property
    def total(self) -> int:
        return len(self.answers)

    @property
    def confusion(self) -> Ints:
        """(n, n) counts, [true posture, answer]."""
        counts = np.zeros((len(self.labels), len(self.labels)), dtype=np.int64)
        for answer in self.answers:
            counts[answer.true, answer.given] += 1
        return counts

    @property
    def tested(self) -> Ints:
        """(n,) examples by posture."""
        return np.asarray(self.confusion.sum(axis=1))

    @property
    def correct(self) -> Ints:
        """(n,) correct recognitions by posture, the paper's Table 2."""
        return np.asarray(np.diagonal(self.confusion)).copy()

    @property
    def confusions(self) -> list[tuple[str, str, int]]:
        """(true posture, answer, count), largest count first."""
        wrong = self.confusion
        np.fill_diagonal(wrong, 0)
        pairs = sorted(zip(*np.nonzero(wrong), strict=True), key=lambda pair: (-wrong[pair], pair))
        return [(self.labels[true], self.labels[given], int(wrong[true, given])) for true, given in pairs]


def cross_validate(
    examples: Sequence[Example], settings: TrainingSettings, protocol: Protocol, report: Report = no_report
) -> ValidationOutcome:
    """Classify every example with a model trained on the others that the protocol allows.

    A posture of one person only (with the paper's protocol: of one example) cannot be tested, but is a possible result for
    the others.  Background is left out.  Raises UserError where no posture can be tested.
    """
    ready = prepare(postures_of(examples), settings)
    groups = by_person(ready) if protocol == "subjects" else by_repetition(ready)
    answers = held_out_results(
        ready, groups, settings, lambda done, of: report(done, of, f"{protocol}: {done + 1} of {of}")
    )
    report(len(groups), len(groups), f"{protocol}: done")
    people = len({example.person for example in ready.examples})
    if not answers:
        needed = "two people or more that perform" if protocol == "subjects" else "two examples or more of"
        raise UserError(f"{len(ready.examples)} examples by {people} people: allowed: {needed} one posture at least")
    return ValidationOutcome(protocol, ready.labels, people, tuple(answers))


def held_out_results(
    ready: Prepared, groups: Sequence[Sequence[int]], settings: TrainingSettings, report: Callable[[int, int], None]
) -> list[HeldOutResult]:
    """Results of the examples whose posture others have too, in order, each by a model trained without its group.

    groups: indices of examples.  report: groups done, and their number.
    """
    answers: list[HeldOutResult] = []
    for done, held in enumerate(groups):
        report(done, len(groups))
        kept = ready.without(held)
        if tested := [k for k in held if ready.examples[k].label in kept.labels]:
            decide = classifier_of(kept, settings)
            answers += [_answer(ready, k, kept.labels, decide(ready.sequences[k])) for k in tested]
    return sorted(answers, key=lambda answer: answer.example)


def by_person(ready: Prepared) -> list[list[int]]:
    """Indices of each person's examples."""
    people = dict.fromkeys(example.person for example in ready.examples)
    return [[k for k, example in enumerate(ready.examples) if example.person == person] for person in people]


def by_repetition(ready: Prepared) -> list[list[int]]:
    """Indices of two halves: every person's repetitions of a posture alternate, and so do single ones."""
    turn: dict[tuple[str, str], int] = {}
    people: dict[str, int] = {}
    halves: list[list[int]] = [[] for _ in range(HALVES)]
    for k, example in enumerate(ready.examples):
        key = (example.label, example.person)
        if key not in turn:
            turn[key] = people.get(example.label, 0)
            people[example.label] = turn[key] + 1
        halves[turn[key] % HALVES].append(k)
        turn[key] += 1
    return halves


def classifier_of(kept: Prepared, settings: TrainingSettings) -> Callable[[Floats], Classification]:
    """Classification of rows (T, d) by what is learnt from the examples `kept`, without thresholds."""
    if settings.classifier == "paper":
        return partial(classify, train_models(kept, settings))
    values = descriptions_of(kept, settings.rate, settings.seed)
    labels = np.repeat(kept.indices, values.shape[1])
    forest = train_forest(values.reshape(-1, VALUES), labels, len(kept.labels), settings.trees, settings.seed)
    return lambda rows: by_forest(forest, describe(rows, settings.rate))


def _answer(ready: Prepared, k: int, learnt: Sequence[str], found: Classification) -> HeldOutResult:
    own = learnt.index(ready.examples[k].label)
    others = np.delete(found.log_likelihoods, own)
    margin = float(found.log_likelihoods[own] - others.max()) if len(others) else 0.0
    true, given = (ready.labels.index(learnt[index]) for index in (own, found.best))
    return HeldOutResult(k, true, given, margin)
