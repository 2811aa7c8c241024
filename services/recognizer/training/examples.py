"""Examples of postures, training settings, and preparation of examples: one rate, no gaps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.errors import UserError
from zenocap.services.recognizer.features import DEFAULT, KINDS, Kind
from zenocap.services.recognizer.ignored_parts import PARTS, Part, without_parts
from zenocap.services.recognizer.model import MOST_LABELS
from zenocap.services.recognizer.motion_rows import WIDTH
from zenocap.services.recognizer.training.parameters import MAX_EXAMPLE_GAP_S

Scale = Literal["full", "diagonal", "none"]
SCALES: tuple[Scale, ...] = get_args(Scale)
Topology = Literal["left-right", "ergodic"]
TOPOLOGIES: tuple[Topology, ...] = get_args(Topology)
Classifier = Literal["forest", "paper"]
CLASSIFIERS: tuple[Classifier, ...] = get_args(Classifier)
CHOICES = {"classifier": CLASSIFIERS, "features": KINDS, "topology": TOPOLOGIES, "scale": SCALES}  # of settings, by name
RANGES: Mapping[str, tuple[float, float]] = {
    "trees": (1, 10_000), "rate": (1, 1000), "symbols": (2, 1024), "states": (1, 32), "floor": (1e-6, 0.5),
    "spread": (0, 10), "restarts": (1, 100), "folds": (0, 1000), "seed": (0, 2**31 - 1), "false_per_hour": (1e-3, 3600),
}  # fmt: skip
LONGEST_LABEL = 64
BACKGROUND = "-"  # label of movement without postures
LEAST_ROWS = 2


@dataclass(frozen=True)
class Example:
    """One posture of one person.

    features: (T, d) rows at `rate` per second, see `motion_rows`, NaN in frames without a pose; ten angles are enough
    for `paper`.  source: file and line, for errors.
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
class TrainingSettings:
    """Settings of training.  Raises UserError for values out of range.

    classifier: `forest` decides on windows by a forest of trees over whole segments; `paper` by the hidden Markov models,
    which find the windows in both.  trees: of the forest; 50, 100 and 200 differ by 2 of 360 examples of people 108 to 119.
    features: kind of the ten angles.
    rate: frames per second of the models.  symbols: of the codebook.  states: of each
    model [Two-view 5.1].  scale: see `codebook.standardisation`.  floor, spread: see `baum_welch.smoothed` and `spread_of`.
    restarts: of Baum-Welch.  folds: groups of people that are held out in turn to train the thresholds; 0: no thresholds.
    seed: equal seeds give equal models.  false_per_hour: rate of false postures in the background, to which the thresholds
    of the forest are raised; None: thresholds by `thresholds.train_thresholds` alone.
    ignored: parts of the body, up to two.

    64 symbols and 5 states are the paper's.  scale, floor and spread were measured on simulated people 108 to 119, which
    are in no test.  The other defaults were chosen by hand.
    """

    classifier: Classifier = "forest"
    trees: int = 100
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
    false_per_hour: float | None = None
    ignored: tuple[Part, ...] = ()

    def __post_init__(self) -> None:
        for name, allowed in CHOICES.items():
            if getattr(self, name) not in allowed:
                raise UserError(f"{name} = {getattr(self, name)!r}: allowed: {', '.join(allowed)}")
        if unknown := [part for part in self.ignored if part not in PARTS]:
            raise UserError(f"ignored = {unknown[0]!r}: allowed: {', '.join(PARTS)}")
        if len(set(self.ignored)) < len(self.ignored) or {"arms", "legs"} <= set(self.ignored):
            raise UserError(f"ignored = {', '.join(self.ignored)}: allowed: each part once, arms or legs but not both")
        rate = self.false_per_hour
        if rate is not None and (self.classifier != "forest" or not self.folds):
            raise UserError(f"false_per_hour = {rate:g}: allowed: for the classifier forest with thresholds")
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise UserError(f"{name} = {value}: allowed: {low:g} to {high:g}")


@dataclass(frozen=True)
class Prepared:
    """Examples at one rate without gaps.  sequences: (T_i, d) each.  labels: in the order of first occurrence."""

    examples: tuple[Example, ...]
    sequences: tuple[Floats, ...]
    labels: tuple[str, ...]

    def without(self, held: Sequence[int]) -> "Prepared":
        """The other examples, and the labels that they have."""
        keep = np.setdiff1d(np.arange(len(self.examples)), held).tolist()
        examples = tuple(self.examples[k] for k in keep)
        labels = tuple(label for label in self.labels if label in {example.label for example in examples})
        return Prepared(examples, tuple(self.sequences[k] for k in keep), labels)

    @property
    def indices(self) -> Ints:
        """(examples,) index of each one's label."""
        return np.array([self.labels.index(example.label) for example in self.examples])


def postures_of(examples: Sequence[Example]) -> list[Example]:
    """Those that are not background."""
    return [example for example in examples if example.label != BACKGROUND]


def background_of(examples: Sequence[Example], settings: TrainingSettings) -> list[Floats]:
    """Background (T_i, d) at the settings' rate."""
    found = [example for example in examples if example.label == BACKGROUND]
    return list(prepare(found, settings).sequences) if found else []


def prepare(examples: Sequence[Example], settings: TrainingSettings) -> Prepared:
    """Resample examples to the settings' rate.  Raises UserError: no examples; labels, shapes, rates, gaps."""
    if not examples:
        raise UserError("no examples: allowed: one of each posture or more")
    width = examples[0].features.shape[-1]
    sequences = []
    for example in examples:
        if not 1 <= len(example.label) <= LONGEST_LABEL or not example.label.isprintable():
            raise UserError(f"{example}: posture {example.label!r}: allowed: 1 to {LONGEST_LABEL} printable characters")
        if example.features.ndim != 2 or example.features.shape[1] != width or not len(example.features):
            raise UserError(f"{example}: features of shape {example.features.shape}: allowed: (1 or more, {width})")
        if not (np.isfinite(example.rate) and example.rate > 0):
            raise UserError(f"{example}: rate = {example.rate}: allowed: more than 0 frames per second")
        try:
            # Paper (added): examples of any frame rate, with short gaps.
            features = resample(fill_gaps(example.features, example.rate), example.rate, settings.rate)
            features = without_parts(features, settings.ignored)
        except ValueError as error:
            raise UserError(f"{example}: {error}") from None
        if len(features) < LEAST_ROWS:
            least = f"{LEAST_ROWS} or more at {settings.rate:g}/s"
            raise UserError(f"{example}: {len(features)} frames: allowed: {least}")
        sequences.append(features)
    if settings.classifier == "forest" and width != WIDTH:
        raise UserError(f"{examples[0]}: {width} columns: allowed: {WIDTH} for the classifier forest, see `motion_rows`")
    labels = tuple(dict.fromkeys(example.label for example in examples))
    if len(labels) > MOST_LABELS:
        raise UserError(f"{len(labels)} different postures: allowed: {MOST_LABELS} at most")
    return Prepared(tuple(examples), tuple(sequences), labels)


def fill_gaps(features: Floats, rate: float, start_s: float = 0.0) -> Floats:
    """Interpolate rows of feature vectors (T, d) that are not finite; at the ends the nearest row is repeated.

    rate: rows per second.  start_s: time of the first row, for errors.  Raises ValueError with the time span of a gap of
    more than MAX_EXAMPLE_GAP_S.
    """
    known = np.asarray(np.isfinite(features).all(axis=1))
    if known.all():
        return features
    for start, end in gaps(known):
        if end - start > MAX_EXAMPLE_GAP_S * rate:
            gap = f"no angles from {start_s + start / rate:.2f} s to {start_s + end / rate:.2f} s"
            raise ValueError(f"{gap}: allowed: gaps of at most {MAX_EXAMPLE_GAP_S:g} s")
    rows, known_rows = np.arange(len(features)), np.flatnonzero(known)
    return np.stack([np.interp(rows, known_rows, features[known_rows, k]) for k in range(features.shape[1])], axis=1)


def gaps(known: Bools) -> list[tuple[int, int]]:
    """First row and row after the last of every run of rows that are not `known`."""
    edges = np.flatnonzero(np.diff((~known).astype(np.int8), prepend=0, append=0))
    return [(int(start), int(end)) for start, end in zip(edges[::2], edges[1::2], strict=True)]


def resample(features: Floats, rate: float, target_rate: float) -> Floats:
    """Resample feature vectors (T, d) linearly from `rate` to `target_rate` rows per second, starting at the first row."""
    if rate == target_rate or len(features) < 2:
        return features
    count = int(np.floor((len(features) - 1) * target_rate / rate + 1e-6)) + 1
    at = np.minimum(np.arange(count) * (rate / target_rate), len(features) - 1)
    rows = np.arange(len(features))
    return np.stack([np.interp(at, rows, features[:, k]) for k in range(features.shape[1])], axis=1)
