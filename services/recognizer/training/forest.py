"""Training of the extremely randomized trees and of their acceptance thresholds.

Geurts, Ernst and Wehenkel, Extremely randomized trees (2006).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from sklearn.ensemble import ExtraTreesClassifier
from threadpoolctl import threadpool_limits

from zenocap.common.arrays import Floats, Ints
from zenocap.services.recognizer.forest import FEATURE, LEAF, OTHER, THRESHOLD, Forest, votes_of
from zenocap.services.recognizer.model import LabelFigures
from zenocap.services.recognizer.segment_description import describe
from zenocap.services.recognizer.training.examples import Prepared
from zenocap.services.recognizer.training.parameters import CUT_SHARE, CUTS, LEAF_DESCRIPTIONS, LEAF_FROM_EXAMPLES
from zenocap.services.recognizer.training.thresholds import train_thresholds, with_trials

NO_SHARE = 0.0  # threshold of forests without thresholds, which accept every segment


def descriptions_of(ready: Prepared, rate: float, seed: int) -> Floats:
    """(examples, CUTS + 1, VALUES) descriptions of prepared examples; rate: of their rows.

    The first is of the whole example, the others of the example with other ends, as windows of a stream have them.  Up to
    CUT_SHARE of it is missing at either end, or the person stands there for as long.
    """
    found = []
    for k, rows in enumerate(ready.sequences):
        rng = np.random.default_rng((seed, k))
        shifts = np.round(rng.uniform(-CUT_SHARE, CUT_SHARE, (CUTS, 2)) * len(rows)).astype(np.int64)
        found.append([describe(rows, rate), *(describe(_with_ends(rows, *pair), rate) for pair in shifts.tolist())])
    return np.array(found)


def _with_ends(rows: Floats, begin: int, end: int) -> Floats:
    """Rows (T, d) from row `begin` to `end` rows after the last; rows beyond repeat the first or the last."""
    at = np.clip(np.arange(begin, max(len(rows) + end, begin + 1)), 0, len(rows) - 1)
    return rows[at]


def train_forest(values: Floats, labels: Ints, count: int, trees: int, seed: int) -> Forest:
    """Forest without thresholds.

    values: (k, VALUES).  labels: (k,) indices of postures, or `count` for none of them; one that does not occur gets no
    votes.  Equal arguments give equal forests.
    """
    single = values.astype(np.float32)
    rarest = min(np.bincount(labels)[np.unique(labels)])
    leaf = LEAF_DESCRIPTIONS if rarest >= LEAF_FROM_EXAMPLES * (CUTS + 1) else 1
    found = ExtraTreesClassifier(trees, random_state=seed, min_samples_leaf=leaf, class_weight="balanced", n_jobs=1)
    with threadpool_limits(limits=1):
        found.fit(single, labels)
    most = max(one.tree_.node_count for one in found.estimators_)
    nodes = np.zeros((trees, most, 3))
    nodes[:, :, FEATURE] = LEAF
    for row, one in zip(nodes, found.estimators_, strict=True):
        tree = one.tree_
        inner = tree.children_left >= 0
        if not np.array_equal(tree.children_left[inner], np.flatnonzero(inner) + 1):
            raise AssertionError("the nodes of a tree are not in depth-first order")
        likeliest = found.classes_[np.argmax(tree.value[:, 0], axis=1)]
        size = tree.node_count
        row[:size, FEATURE] = np.where(inner, tree.feature, LEAF)
        row[:size, THRESHOLD] = np.where(inner, _rounded_down(tree.threshold), 0.0)
        row[:size, OTHER] = np.where(inner, tree.children_right, likeliest)
    return Forest(nodes, np.full(count, NO_SHARE))


def _rounded_down(thresholds: Floats) -> Floats:
    """The largest single-precision numbers up to the thresholds: values in single precision compare with them equally."""
    single = thresholds.astype(np.float32)
    down: Floats = np.where(single > thresholds, np.nextafter(single, np.float32(-np.inf)), single).astype(np.float64)
    return down


@dataclass(frozen=True, eq=False)
class ForestData:
    """Training data of a forest.

    values: (examples, CUTS + 1, VALUES), see `descriptions_of`.  labels: (examples,) indices below `count`.
    proposed, regular: (m, VALUES) descriptions of windows without a posture, see `background`.
    """

    values: Floats
    labels: Ints
    count: int
    proposed: Floats
    regular: Floats


def forest_of(data: ForestData, kept: Ints, trees: int, seed: int) -> Forest:
    """Forest without thresholds of the examples `kept` and the background."""
    values = data.values[kept]
    none = np.concatenate([data.proposed, data.regular])
    labels = np.concatenate([np.repeat(data.labels[kept], values.shape[1]), np.full(len(none), data.count)])
    return train_forest(np.concatenate([values.reshape(-1, values.shape[-1]), none]), labels, data.count, trees, seed)


@dataclass(frozen=True, eq=False)
class Trials:
    """Shares of votes for examples by forests that are trained without them.

    held: index of the posture, of the one with most votes, and shares (n,), for each held-out description whose posture is
    trained.  strangers: index of the posture with most votes and its share, for each description without its own posture.
    Both are in blocks of one example: the whole one first.  background: the same as strangers, for windows without a
    posture that the hidden Markov models propose, by a forest that is trained without that half of the background.
    """

    held: tuple[tuple[int, int, Floats], ...]
    strangers: tuple[tuple[int, float], ...]
    background: tuple[tuple[int, float], ...]


def with_thresholds(forest: Forest, trials: Trials) -> Forest:
    """The forest with thresholds by the costs of `thresholds.train_thresholds`, of shares instead of scores."""
    n = len(forest.thresholds)
    correct = [np.array([shares[label] for label, _, shares in trials.held if label == k]) for k in range(n)]
    refused = (*trials.strangers, *trials.background)
    impostors = [np.array([share for best, share in refused if best == k]) for k in range(n)]
    if not trials.held:
        return forest
    return replace(forest, thresholds=train_thresholds(correct, impostors))


def figures_of(counted: Sequence[LabelFigures], forest: Forest, trials: Trials) -> tuple[LabelFigures, ...]:
    """The numbers of each posture, with those of the trials of whole examples."""
    figures = []
    whole, others = trials.held[:: CUTS + 1], trials.strangers[:: CUTS + 1]
    for k, (known, needed) in enumerate(zip(counted, forest.thresholds, strict=True)):
        own = [(best, shares[k]) for label, best, shares in whole if label == k]
        recognized = [float(share) for best, share in own if best == k]
        strangers = [share for best, share in others if best == k]
        figures.append(with_trials(known, float(needed), len(own), recognized, strangers))
    return tuple(figures)


def trials_of(data: ForestData, groups: Sequence[Sequence[int]], trees: int, seed: int) -> Trials:
    """Trials of all examples, once with others of their posture and once without, and of the proposed background.

    groups: indices of examples that are held out together.
    """
    tried: list[tuple[int, int, Floats]] = []
    every = np.arange(len(data.labels))
    for held in groups:
        kept = np.setdiff1d(every, held)
        if not len(kept):
            continue
        forest = forest_of(data, kept, trees, seed)
        for k in held:
            if data.labels[k] in data.labels[kept]:
                shares = _shares(forest, data.values[k])
                tried += [(int(data.labels[k]), int(np.argmax(one)), one) for one in shares]
    strangers: list[tuple[int, float]] = []
    for label in range(data.count) if data.count > 1 else ():
        forest = forest_of(data, np.flatnonzero(data.labels != label), trees, seed)
        for stranger in np.flatnonzero(data.labels == label):
            strangers += [(int(np.argmax(one)), float(one.max())) for one in _shares(forest, data.values[stranger])]
    background: list[tuple[int, float]] = []
    for half in (0, 1) if len(data.proposed) else ():
        others = replace(data, proposed=_half(data.proposed, 1 - half), regular=_half(data.regular, 1 - half))
        shares = _shares(forest_of(others, every, trees, seed), _half(data.proposed, half))
        background += [(int(np.argmax(one)), float(one.max())) for one in shares]
    return Trials(tuple(tried), tuple(strangers), tuple(background))


def _half(windows: Floats, half: int) -> Floats:
    """First (0) or second (1) half of windows (m, VALUES)."""
    middle = len(windows) // 2
    return windows[middle:] if half else windows[:middle]


def _shares(forest: Forest, values: Floats) -> Floats:
    """(k, n) shares of votes for the postures by values (k, VALUES)."""
    shares = [votes_of(forest, one)[:-1] / len(forest.nodes) for one in values]
    return np.array(shares).reshape(len(values), len(forest.thresholds))
