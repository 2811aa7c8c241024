"""Ablation of the forest's features: each group of values left out, and each group alone.

The 554 values of `segment_description` are divided twice: by the channel that they describe, and by the statistic.
"""

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.recognition.bench import Bench
from benchmarks.recognition.everyday import everyday_examples
from benchmarks.recognition.real import missing_motions, real_examples
from benchmarks.sections import Row, Section, Table
from zenocap.common.arrays import Floats, Ints
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.forest import Forest, votes_of
from zenocap.services.recognizer.motion_rows import ANGLES, HEIGHT, POINTS, TRUNK_UP
from zenocap.services.recognizer.parameters import QUANTILES, THIRDS
from zenocap.services.recognizer.segment_description import CHANNELS, VALUES, describe
from zenocap.services.recognizer.training.examples import Example, Prepared, TrainingSettings, background_of, prepare
from zenocap.services.recognizer.training.forest import descriptions_of, train_forest
from zenocap.services.recognizer.training.rejection_rate import windows_of
from zenocap.services.recognizer.training.thresholds import held_out_groups
from zenocap.services.recognizer.training.train import train_models
from zenocap.tools.dataset.batch import people
from zenocap.tools.dataset.generate import Method

SETTINGS = TrainingSettings()
FOREST_SEEDS = 3  # no more than seeds of people
FOLDS = 4  # groups of people that are held out in turn
BACKGROUND_SEED = 12  # persons 144 and after, who are in no other part: half of them in training, half tested
BACKGROUND_PEOPLE, BACKGROUND_MINUTES = 6, 1.5
ACCEPTED = 0.95  # of the postures of tested people, at the threshold with which windows of everyday movement are taken

# Channels of `segment_description.channels`, in order.
FORWARDS, LEFTWARDS, LENGTH, TURN, RISE = range(HEIGHT + 1, HEIGHT + 6)
CHANNEL_GROUPS: Mapping[str, tuple[int, ...]] = {
    "angles": tuple(range(ANGLES.start, ANGLES.stop)),
    "joint positions": tuple(range(POINTS.start, POINTS.stop)),
    "lean of the trunk": tuple(range(TRUNK_UP.start, TRUNK_UP.stop)),
    "height of the hips": (HEIGHT, RISE),
    "velocity of the hips": (FORWARDS, LEFTWARDS, LENGTH),
    "turn": (TURN,),
    "speeds of the joints": tuple(range(RISE + 1, CHANNELS)),
}
# The values of the whole segment, after all channels: way forwards and to the left, turn, duration.
WHOLE_GROUPS: Mapping[str, tuple[int, ...]] = {"velocity of the hips": (0, 1), "turn": (2,), "duration": (3,)}
STATISTICS: Mapping[str, int] = {  # values of each channel, in the order of `describe`
    "means": 1, "deviations": 1, "quantiles": len(QUANTILES), "means of thirds": THIRDS, "last minus first": 1,
}  # fmt: skip
EVERY = "all"


@dataclass(frozen=True, eq=False)
class Material:
    """Descriptions of one set of examples.

    values: (examples, CUTS + 1, VALUES).  labels: (examples,) indices below `count`.  groups: indices held out together.
    missing: examples without poses, which count as not recognized.
    """

    values: Floats
    labels: Ints
    count: int
    groups: tuple[tuple[int, ...], ...]
    missing: int = 0


@dataclass(frozen=True, eq=False)
class Everyday:
    """Descriptions (m, VALUES) of windows of everyday movement: of people in training, and of the tested ones."""

    trained: Floats
    tested: Floats


def by_channel() -> dict[str, Ints]:
    """Indices of values by the group of channels that they describe."""
    repeats = (VALUES - _whole()) // CHANNELS
    found: dict[str, list[int]] = {name: [] for name in (*CHANNEL_GROUPS, *WHOLE_GROUPS)}
    for name, channels in CHANNEL_GROUPS.items():
        found[name] += [repeat * CHANNELS + channel for repeat in range(repeats) for channel in channels]
    for name, places in WHOLE_GROUPS.items():
        found[name] += [repeats * CHANNELS + place for place in places]
    return {name: np.array(indices) for name, indices in found.items()}


def by_statistic() -> dict[str, Ints]:
    """Indices of values by statistic; the last group has those of the whole segment."""
    found, begin = {}, 0
    for name, repeats in STATISTICS.items():
        found[name] = np.arange(begin, begin + repeats * CHANNELS)
        begin += repeats * CHANNELS
    return {**found, "of the whole segment": np.arange(begin, VALUES)}


def _whole() -> int:
    return sum(map(len, WHOLE_GROUPS.values()))


def variants() -> dict[str, Ints]:
    """Indices of the values that each variant uses."""
    every = np.arange(VALUES)
    groups = {**by_channel(), **by_statistic()}
    return {
        EVERY: every,
        **{f"without {name}": np.setdiff1d(every, indices) for name, indices in groups.items()},
        **{f"only {name}": indices for name, indices in groups.items()},
    }


def ablation(bench: Bench) -> Section:
    """Section of all sources of poses that are not too dear, and of real motion."""
    tables, forests = [], min(FOREST_SEEDS, bench.seeds)
    for method in [one for one in bench.poses if one != "hybrid"]:
        sets = [_simulated(bench, method, seed) for seed in range(bench.seeds)]
        tables.append(_table(f"Poses by {method}", sets, _everyday(bench, method), forests))
    if not missing_motions(bench.motions):
        examples = real_examples(bench)
        ready = prepare(examples, SETTINGS)
        groups = tuple(map(tuple, held_out_groups(ready, len(examples))))
        tables.append(_table("Real motion", [_material(ready, groups)], None, forests))
    notes = (
        f"Recognized: {bench.count} people x 15 postures x 2, {bench.seeds} seeds of people, in {FOLDS} groups of people "
        "that are held out in turn; real motion: as in the part real, a take or span held out. Examples without poses "
        f"count as not recognized. {forests} seeds of the forest: mean (worst).",
        "Margin: votes for the true posture minus those for the best other, % of the trees, mean over the examples.",
        "Taken: a forest is trained with the examples of one half of the people of the first seed and everyday movement of "
        f"{BACKGROUND_PEOPLE // 2} other people ({BACKGROUND_MINUTES:g} min of each); its threshold accepts "
        f"{100 * ACCEPTED:g} % of the postures of the other half. Share of the windows of everyday movement of "
        f"{BACKGROUND_PEOPLE // 2} further people that it takes for a posture.",
    )
    return Section("ablation", "Ablation of features", notes, tuple(tables))


def _simulated(bench: Bench, method: Method, seed: int) -> Material:
    examples = bench.examples(method, seed, DEFAULT)
    ready = prepare(examples, SETTINGS)
    groups = held_out_groups(ready, min(FOLDS, bench.count))
    return _material(ready, tuple(map(tuple, groups)), len(bench.posture_takes(seed)) - len(examples))


def _material(ready: Prepared, groups: tuple[tuple[int, ...], ...], missing: int = 0) -> Material:
    names = sorted(ready.labels)  # equal order in all sets
    labels = np.array([names.index(example.label) for example in ready.examples])
    return Material(descriptions_of(ready, SETTINGS.rate, SETTINGS.seed), labels, len(ready.labels), groups, missing)


def _everyday(bench: Bench, method: Method) -> Everyday:
    """Windows on which the forest decides, as proposed by hidden Markov models of the examples of people 0."""
    model = train_models(prepare(bench.examples(method, 0, DEFAULT), SETTINGS), SETTINGS)
    halves: list[list[Example]] = [[], []]
    for number, seed in enumerate(people(BACKGROUND_SEED, BACKGROUND_PEOPLE)):
        halves[number % 2] += everyday_examples(bench, method, seed, BACKGROUND_MINUTES)
        print(f"{method}, everyday movement: {number + 1} of {BACKGROUND_PEOPLE}", file=sys.stderr, flush=True)
    found = [windows_of(model, background_of(half, SETTINGS)) for half in halves]
    return Everyday(*(np.array([describe(rows, SETTINGS.rate) for rows in windows]) for windows in found))


def _table(title: str, sets: Sequence[Material], everyday: Everyday | None, forests: int) -> Table:
    missing = sum(one.missing for one in sets)
    rows: list[Row] = []
    total = 0
    for name, columns in variants().items():
        right, margins, taken = [], [], []
        for seed in range(forests):
            tried = [pair for one in sets for pair in trials(one, columns, seed)]
            total = len(tried) + missing
            right.append(sum(margin > 0.0 for margin in tried))
            margins.append(100.0 * float(np.mean(tried)))
            if everyday is not None:
                taken.append(100.0 * share_taken(sets[0], everyday, columns, seed))
        cells = (f"{np.mean(right):.1f} ({min(right)})", f"{np.mean(margins):.1f} ({min(margins):.1f})")
        rows.append((name, len(columns), *cells, f"{np.mean(taken):.1f} ({max(taken):.1f})" if taken else ""))
        print(title, *rows[-1], file=sys.stderr, flush=True)
    return Table(title, ("values", "number", f"recognized of {total}", "margin %", "taken %"), tuple(rows))


def trials(material: Material, columns: Ints, seed: int) -> Iterable[float]:
    """Share of the trees for the true posture minus that of the best other one, of each example held out.

    Examples whose posture is not in the training are left out.
    """
    for held in material.groups:
        kept = np.setdiff1d(np.arange(len(material.labels)), held)
        forest = _forest(material, kept, np.zeros((0, VALUES)), columns, seed)
        for k in held:
            label = material.labels[k]
            if label in material.labels[kept]:
                shares = shares_of(forest, material.values[k, 0, columns])[:-1]
                yield float(shares[label] - np.delete(shares, label).max(initial=0.0))


def share_taken(material: Material, everyday: Everyday, columns: Ints, seed: int) -> float:
    """Share of the tested windows of everyday movement that get a posture where ACCEPTED of the tested postures do.

    The first half of the groups is trained, the others are tested.
    """
    half = len(material.groups) // 2
    trained, tested = (np.concatenate(part) for part in (material.groups[:half], material.groups[half:]))
    forest = _forest(material, trained, everyday.trained, columns, seed)
    own = [shares_of(forest, material.values[k, 0, columns])[material.labels[k]] for k in tested]
    least = float(np.quantile(own, 1.0 - ACCEPTED))
    others = np.array([shares_of(forest, values[columns]) for values in everyday.tested])
    best = others[:, :-1].max(axis=1)
    return float(np.mean((best >= least) & (best >= others[:, -1])))


def _forest(material: Material, kept: Ints, none: Floats, columns: Ints, seed: int) -> Forest:
    values = material.values[kept]
    labels = np.concatenate([np.repeat(material.labels[kept], values.shape[1]), np.full(len(none), material.count)])
    every = np.concatenate([values.reshape(-1, VALUES), none])
    return train_forest(every[:, columns], labels, material.count, SETTINGS.trees, seed)


def shares_of(forest: Forest, values: Floats) -> Floats:
    """(n + 1,) shares of the trees for each posture, and for none."""
    shares: Floats = votes_of(forest, values) / len(forest.nodes)
    return shares
