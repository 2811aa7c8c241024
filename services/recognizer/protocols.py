"""How well postures are told apart on examples that were not learnt from, by two ways of holding out.  [Two-view 5.2]

`paper`: every person is in training and in test, with different repetitions of each posture.  `subjects`: every person is
tested on models that have never seen that person.  As in the paper, the likeliest model is the answer, whatever its score.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from services.recognizer.examples import Example, ExampleError, Plan, Prepared, prepared
from services.recognizer.fitting import Report, fitted
from services.recognizer.model import PostureModel, judge

Protocol = Literal["paper", "subjects"]
PROTOCOLS: tuple[Protocol, ...] = get_args(Protocol)
HALVES = 2


@dataclass(frozen=True)
class Answer:
    """example: index.  true, given: indices of labels.  margin: log-likelihood above the best other posture, of `true`."""

    example: int
    true: int
    given: int
    margin: float


@dataclass(frozen=True)
class Outcome:
    """answers: one for each example that could be tested, in order.  people: how many."""

    protocol: Protocol
    labels: tuple[str, ...]
    people: int
    answers: tuple[Answer, ...]

    @property
    def right(self) -> int:
        return sum(answer.true == answer.given for answer in self.answers)

    @property
    def total(self) -> int:
        return len(self.answers)

    @property
    def confusion(self) -> NDArray[np.int64]:
        """(n, n) counts, [true posture, answer]."""
        counts = np.zeros((len(self.labels), len(self.labels)), dtype=np.int64)
        for answer in self.answers:
            counts[answer.true, answer.given] += 1
        return counts

    @property
    def tested(self) -> NDArray[np.int64]:
        """(n,) examples by posture."""
        return np.asarray(self.confusion.sum(axis=1))

    @property
    def correct(self) -> NDArray[np.int64]:
        """(n,) correct recognitions by posture, the paper's Table 2."""
        return np.asarray(np.diagonal(self.confusion)).copy()

    @property
    def confusions(self) -> list[tuple[str, str, int]]:
        """(true posture, answer, how often), the most frequent first."""
        wrong = self.confusion
        np.fill_diagonal(wrong, 0)
        pairs = sorted(zip(*np.nonzero(wrong), strict=True), key=lambda pair: (-wrong[pair], pair))
        return [(self.labels[true], self.labels[given], int(wrong[true, given])) for true, given in pairs]


def evaluated(
    examples: Sequence[Example], plan: Plan, protocol: Protocol, report: Report = lambda done, of, words: None
) -> Outcome:
    """Every example tried on models of the others that the protocol allows.

    Postures that one person only shows (or, by the paper's protocol, one example) cannot be tested; they still stand
    against the others.  Raises ExampleError where none can be.
    """
    ready = prepared(examples, plan)
    groups = by_person(ready) if protocol == "subjects" else by_repetition(ready)
    answers: list[Answer] = []
    for done, held in enumerate(groups):
        report(done, len(groups), f"{protocol}: {done + 1} of {len(groups)}")
        out = set(held)
        kept = ready.chosen([k for k in range(len(ready.examples)) if k not in out])
        learnt = tuple(label for label in ready.labels if any(example.label == label for example in kept.examples))
        tested = [k for k in held if ready.examples[k].label in learnt]
        if tested:
            model = fitted(replace(kept, labels=learnt), plan)
            answers += [_answer(ready, k, model) for k in tested]
    report(len(groups), len(groups), f"{protocol}: done")
    people = len({example.person for example in ready.examples})
    if not answers:
        needed = "two people or more that show" if protocol == "subjects" else "two examples or more of"
        raise ExampleError(f"{len(ready.examples)} examples by {people} people: allowed: {needed} one posture at least")
    return Outcome(protocol, ready.labels, people, tuple(sorted(answers, key=lambda answer: answer.example)))


def by_person(ready: Prepared) -> list[list[int]]:
    """Indices of each person's examples."""
    people = dict.fromkeys(example.person for example in ready.examples)
    return [[k for k, example in enumerate(ready.examples) if example.person == person] for person in people]


def by_repetition(ready: Prepared) -> list[list[int]]:
    """Indices of two halves: every person's repetitions of a posture by turns, single ones shared out by turns as well."""
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


def _answer(ready: Prepared, k: int, model: PostureModel) -> Answer:
    found = judge(model, ready.sequences[k])
    own = model.labels.index(ready.examples[k].label)
    others = np.delete(found.log_likelihoods, own)
    margin = float(found.log_likelihoods[own] - others.max()) if len(others) else 0.0
    true, given = (ready.labels.index(model.labels[index]) for index in (own, found.best))
    return Answer(k, true, given, margin)
