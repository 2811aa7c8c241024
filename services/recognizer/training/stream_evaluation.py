"""Evaluation of a model on streams against labelled spans."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

import numpy as np

from zenocap.services.recognizer.commands import confidence_of
from zenocap.services.recognizer.model import LEAST_VOTES, Classification, PostureModel
from zenocap.services.recognizer.stream import StreamSetup, recognitions, stream_setup
from zenocap.services.recognizer.training.example_files import Features
from zenocap.services.recognizer.training.examples import BACKGROUND
from zenocap.services.recognizer.training.parameters import OVERLAP_SHARE


@dataclass(frozen=True)
class PostureSpan:
    """A labelled posture, seconds from the start of its source."""

    label: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class PostureAnswer(PostureSpan):
    """A posture that a model publishes.  at_s: time of the deciding frame.  confidence: 0 to 1, as of commands.

    level: with a forest the share of the trees that vote for it, else its score above the threshold.
    """

    at_s: float
    level: float
    confidence: float


@dataclass(frozen=True)
class StreamScore:
    """Counts of one posture, or of all.

    events: labelled.  right: answers that overlap a labelled span of their posture by OVERLAP_SHARE of the shorter one, one
    for each.  wrong: other answers.  delays_s: from the labelled end to each right answer.  hours: of all streams.
    """

    events: int
    right: int
    wrong: int
    delays_s: tuple[float, ...]
    hours: float

    @property
    def recall(self) -> float:
        """Share of the labelled postures that are recognized; NaN without any."""
        return self.right / self.events if self.events else float("nan")

    @property
    def precision(self) -> float:
        """Share of the answers that are right; NaN without any."""
        return self.right / (self.right + self.wrong) if self.right + self.wrong else float("nan")

    @property
    def false_per_hour(self) -> float:
        """Rate of wrong answers."""
        return self.wrong / self.hours if self.hours else float("nan")

    def delay_s(self, quantile: float) -> float:
        """Quantile of the delays; NaN without any."""
        return float(np.quantile(self.delays_s, quantile)) if self.delays_s else float("nan")


@dataclass(frozen=True)
class StreamOutcome:
    """Labelled spans and answers by source.  hours: duration with poses of all sources."""

    labels: tuple[str, ...]
    truths: tuple[tuple[PostureSpan, ...], ...]
    answers: tuple[tuple[PostureAnswer, ...], ...]
    hours: float

    def score(self, label: str | None = None, least: float = -np.inf) -> StreamScore:
        """Score of a posture; None: of all.  least: level below which answers are left out."""
        sources = zip(self.truths, self.answers, strict=True)
        pairs = [matched(truth, [a for a in given if a.level >= least]) for truth, given in sources]
        right = [pair for right, _ in pairs for pair in right if label in (None, pair[1].label)]
        wrong = [answer for _, wrong in pairs for answer in wrong if label in (None, answer.label)]
        events = sum(label in (None, one.label) for truth in self.truths for one in truth)
        delays = tuple(answer.at_s - event.end_s for event, answer in right)
        return StreamScore(events, len(right), len(wrong), delays, self.hours)

    def curve(self) -> list[tuple[float, StreamScore]]:
        """Least level and score of all postures, from the model's own thresholds to no answer."""
        levels = sorted({answer.level for given in self.answers for answer in given})
        return [(level, self.score(least=level)) for level in levels]


def evaluate_streams(model: PostureModel, sources: Sequence[tuple[Features, Sequence[PostureSpan]]]) -> StreamOutcome:
    """Outcome of sources with their labelled spans."""
    setup = stream_setup(model)
    answers = tuple(tuple(answers_of(setup, motion)) for motion, _ in sources)
    hours = sum(int(np.isfinite(motion.features).all(axis=1).sum()) / motion.rate for motion, _ in sources) / 3600.0
    return StreamOutcome(model.labels, tuple(tuple(truth) for _, truth in sources), answers, hours)


def answers_of(setup: StreamSetup, motion: Features) -> list[PostureAnswer]:
    """Postures that a model publishes while the frames of a source arrive, and after them, at the time of the last."""
    found, times_s = [], motion.times_s.tolist()
    for number, answer in recognitions(setup, [round(time_s * 1e9) for time_s in times_s], motion.features):
        if answer.label is not None:
            at_s, scores = times_s[min(number, len(times_s) - 1)], answer.classification
            score = float(scores.scores[scores.best])
            level, confidence = _level(setup.model, scores, score), confidence_of(score, scores.margin, len(scores.scores))
            found.append(PostureAnswer(answer.label, answer.start_ns / 1e9, answer.end_ns / 1e9, at_s, level, confidence))
    return found


def _level(model: PostureModel, found: Classification, score: float) -> float:
    if model.forest is None:
        return score - float(model.thresholds[found.best])
    trees = len(model.forest.nodes)
    return round(trees + LEAST_VOTES - exp(-score) * (trees + LEAST_VOTES)) / trees


def matched(
    truth: Sequence[PostureSpan], given: Sequence[PostureAnswer]
) -> tuple[list[tuple[PostureSpan, PostureAnswer]], list[PostureAnswer]]:
    """Right answers with their labelled spans, and wrong ones.  Each span has one right answer at most."""
    free, right, wrong = list(truth), [], []
    for answer in given:
        fits = [event for event in free if event.label == answer.label and overlaps(event, answer)]
        if fits:
            best = max(fits, key=lambda event: shared_s(event, answer))
            free.remove(best)
            right.append((best, answer))
        else:
            wrong.append(answer)
    return right, wrong


def overlaps(event: PostureSpan, answer: PostureSpan) -> bool:
    """Whether both share OVERLAP_SHARE of the shorter one; of background, of the answer."""
    length = answer.end_s - answer.start_s
    if event.label != BACKGROUND:
        length = min(event.end_s - event.start_s, length)
    return shared_s(event, answer) >= OVERLAP_SHARE * length > 0.0


def shared_s(event: PostureSpan, answer: PostureSpan) -> float:
    """Duration that both have in common, seconds."""
    return max(0.0, min(event.end_s, answer.end_s) - max(event.start_s, answer.start_s))
