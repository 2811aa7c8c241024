"""From examples of postures to their models: codebook, hidden Markov models, and when a posture is none of them."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.codebook import SCALES, Codebook, Scale, codebook_of, nearest, whitened
from services.recognizer.edges import edges_of, reach_of
from services.recognizer.features import DEFAULT, KINDS, Kind
from services.recognizer.hmm import TOPOLOGIES, Hmm, Symbols, Topology, learnt, smoothed, spread_of
from services.recognizer.model import FARTHEST, LEAST_SCORE, LabelFigures, PostureModel, Training
from services.recognizer.sequences import bridged, resampled

Report = Callable[[int, int, str], None]
LONGEST_LABEL = 64
LEAST_ROWS = 2


class ExampleError(ValueError):
    """Examples that nothing can be learnt from; the text names which, what is wrong and what is allowed."""


@dataclass(frozen=True)
class Example:
    """One posture by one person.  features: (T, d) radians at `rate` per second, NaN where there is none.

    source: the file it is from, for errors.
    """

    label: str
    person: str
    repetition: str
    rate: float
    features: Floats
    source: str = ""

    def __str__(self) -> str:
        return self.source or f"{self.label!r} by {self.person!r}, repetition {self.repetition!r}"


@dataclass(frozen=True)
class Plan:
    """How to learn.  Raises ExampleError when made with values out of range.

    features: of the examples.  rate: frames per second of the models.  symbols, states: of codebook and models
    [Two-view 5.1].  scale: of the features before k-means.  floor, spread: see `hmm.smoothed` and `hmm.spread_of`.
    restarts: trials of Baum-Welch.  folds: groups of people that are held out in turn to find the thresholds; 0 for no
    thresholds.
    """

    features: Kind = DEFAULT
    rate: float = 15.0
    symbols: int = 64
    states: int = 5
    topology: Topology = "left-right"
    scale: Scale = "diagonal"
    floor: float = 0.01
    spread: float = 1.0
    restarts: int = 1
    folds: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        for name, allowed in (("features", KINDS), ("topology", TOPOLOGIES), ("scale", SCALES)):
            if getattr(self, name) not in allowed:
                raise ExampleError(f"{name} = {getattr(self, name)!r}: allowed: {', '.join(allowed)}")
        ranges: tuple[tuple[str, float, float], ...] = (
            ("rate", 1, 1000),
            ("symbols", 2, 1024),
            ("states", 1, 32),
            ("floor", 1e-6, 0.5),
            ("spread", 0, 10),
            ("restarts", 1, 100),
            ("folds", 0, 1000),
            ("seed", 0, 2**31 - 1),
        )
        for name, low, high in ranges:
            if not low <= getattr(self, name) <= high:
                raise ExampleError(f"{name} = {getattr(self, name)}: allowed: {low:g} to {high:g}")


@dataclass(frozen=True)
class Prepared:
    """Examples at one rate without gaps.  sequences: (T_i, d) each.  labels: in the order in which they first come."""

    examples: tuple[Example, ...]
    sequences: tuple[Floats, ...]
    labels: tuple[str, ...]

    def chosen(self, keep: Sequence[int]) -> "Prepared":
        """Only these examples; the labels stay."""
        return Prepared(tuple(self.examples[k] for k in keep), tuple(self.sequences[k] for k in keep), self.labels)


def train(examples: Sequence[Example], plan: Plan, report: Report = lambda done, of, words: None) -> PostureModel:
    """One model for each label of the examples, with thresholds.

    The same examples and plan give the same numbers.  report: is told how many models are done, of how many, and what
    is being learnt.  Raises ExampleError.
    """
    from services.recognizer.thresholds import with_thresholds

    ready = prepared(examples, plan)
    model = fitted(ready, plan, report)
    return with_thresholds(model, ready, plan, report) if plan.folds else model


def prepared(examples: Sequence[Example], plan: Plan) -> Prepared:
    """Examples at the plan's rate.  Raises ExampleError: for no examples, for labels, shapes, rates and gaps."""
    if not examples:
        raise ExampleError("no examples: allowed: one of each posture or more")
    width = examples[0].features.shape[-1]
    sequences = []
    for example in examples:
        if not 1 <= len(example.label) <= LONGEST_LABEL or not example.label.isprintable():
            raise ExampleError(f"{example}: posture {example.label!r}: allowed: 1 to {LONGEST_LABEL} printable characters")
        if example.features.ndim != 2 or example.features.shape[1] != width or not len(example.features):
            raise ExampleError(f"{example}: features of shape {example.features.shape}: allowed: (1 or more, {width})")
        if not (np.isfinite(example.rate) and example.rate > 0):
            raise ExampleError(f"{example}: rate = {example.rate}: allowed: more than 0 frames per second")
        try:
            features = resampled(bridged(example.features, example.rate), example.rate, plan.rate)
        except ValueError as error:
            raise ExampleError(f"{example}: {error}") from None
        if len(features) < LEAST_ROWS:
            least = f"{LEAST_ROWS} or more at {plan.rate:g}/s"
            raise ExampleError(f"{example}: {len(features)} frames: allowed: {least}")
        sequences.append(features)
    return Prepared(tuple(examples), tuple(sequences), tuple(dict.fromkeys(example.label for example in examples)))


def fitted(ready: Prepared, plan: Plan, report: Report = lambda done, of, words: None) -> PostureModel:
    """A model without thresholds: everything is known to it.  Every label needs an example."""
    codebook = codebook_of(ready.sequences, plan.symbols, plan.scale, plan.seed)
    vectors = [whitened(codebook, features) for features in ready.sequences]
    symbols = [nearest(codebook.codewords, some) for some in vectors]
    count = len(codebook.codewords)
    hmms: list[Hmm] = []
    for k, label in enumerate(ready.labels):
        report(k, len(ready.labels), label)
        own = [found for found, example in zip(symbols, ready.examples, strict=True) if example.label == label]
        seed = (plan.seed * 1000003 + k) % 2**31
        hmms.append(learnt(own, count, plan.states, plan.topology, plan.restarts, seed))
    report(len(ready.labels), len(ready.labels), "done")
    return _model(ready, plan, codebook, vectors, symbols, hmms)


def _model(
    ready: Prepared,
    plan: Plan,
    codebook: Codebook,
    vectors: Sequence[Floats],
    symbols: Sequence[Symbols],
    hmms: Sequence[Hmm],
) -> PostureModel:
    count = len(codebook.codewords)
    seen = np.bincount(np.concatenate(symbols), minlength=count) + 1.0
    occurring = np.asarray(seen / seen.sum(), dtype=np.float64)
    emission = np.stack([hmm.emission for hmm in hmms])
    n = len(ready.labels)
    of = [ready.labels.index(example.label) for example in ready.examples]
    edges, calm, slow = edges_of(of, n, vectors, plan.rate)
    return PostureModel(
        plan.features,
        plan.rate,
        ready.labels,
        codebook.mean,
        codebook.whitening,
        codebook.codewords,
        np.stack([hmm.start for hmm in hmms]),
        np.stack([hmm.transition for hmm in hmms]),
        smoothed(emission, spread_of(codebook.codewords, plan.spread), plan.floor, occurring),
        _durations(ready, plan.rate),
        edges,
        reach_of(of, n, vectors),
        np.full(n, LEAST_SCORE),
        FARTHEST,
        calm,
        slow,
        _training(ready, plan),
    )


def _durations(ready: Prepared, rate: float) -> Floats:
    """(n, 3) seconds: shortest, median and longest example of every label."""
    rows = []
    for label in ready.labels:
        pairs = zip(ready.sequences, ready.examples, strict=True)
        seconds = [len(features) / rate for features, example in pairs if example.label == label]
        rows.append([min(seconds), float(np.median(seconds)), max(seconds)])
    return np.array(rows)


def _training(ready: Prepared, plan: Plan) -> Training:
    figures = []
    for label in ready.labels:
        own = [example for example in ready.examples if example.label == label]
        figures.append(LabelFigures(len(own), len({example.person for example in own})))
    return Training(
        tuple(sorted({example.person for example in ready.examples})),
        tuple(dict.fromkeys(example.source for example in ready.examples if example.source)),
        sum(map(len, ready.sequences)),
        {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in asdict(plan).items()},
        tuple(figures),
    )
