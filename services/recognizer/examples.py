"""Examples of postures, how to learn from them, and examples made ready: at one rate and without gaps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from common.body.anatomy import Floats
from services.recognizer.features import DEFAULT, KINDS, Kind
from services.recognizer.model import MOST_LABELS
from services.recognizer.sequences import bridged, resampled

Scale = Literal["full", "diagonal", "none"]
SCALES: tuple[Scale, ...] = get_args(Scale)
Topology = Literal["left-right", "ergodic"]
TOPOLOGIES: tuple[Topology, ...] = get_args(Topology)
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
    scale: Scale = "none"
    floor: float = 0.03
    spread: float = 0.25
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
    labels = tuple(dict.fromkeys(example.label for example in examples))
    if len(labels) > MOST_LABELS:
        raise ExampleError(f"{len(labels)} different postures: allowed: {MOST_LABELS} at most")
    return Prepared(tuple(examples), tuple(sequences), labels)
