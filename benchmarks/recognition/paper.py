"""Table 2 of [Two-view 5] in the paper's configuration, with the confusions that the paper does not give.

Ten joint angles, 64 symbols, five states, emissions without smoothing, no rejection; of the two repetitions by every person
one trains and the other is tested, in turn.
"""

import numpy as np

from benchmarks.recognition.accuracy import PAPER
from benchmarks.recognition.bench import Bench
from benchmarks.sections import Row, Section, Table
from zenocap.common.arrays import Ints
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.training.cross_validation import Outcome, cross_validate
from zenocap.services.recognizer.training.examples import Topology, TrainingSettings
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.tools.dataset.generate import Method

METHODS: tuple[Method, ...] = ("two-view-paper", "two-view")
TOPOLOGIES: tuple[Topology, ...] = ("left-right", "ergodic")  # 5.1: left-right; Fig. 15 has transitions back as well
FEATURES: Kind = "joint-angles"
NO_SMOOTHING = 1e-6  # the smallest floor: without it one unknown symbol makes every model impossible


def as_in_the_paper(bench: Bench) -> Section:
    """Totals of each method and topology, and the confusion matrix of the paper's variant with left-right models."""
    totals: list[Row] = []
    matrices: list[Ints] = []
    for method in METHODS:
        examples = [bench.examples(method, seed, FEATURES) for seed in range(bench.seeds)]
        for topology in TOPOLOGIES:
            settings = TrainingSettings(
                classifier="paper", features=FEATURES, topology=topology, floor=NO_SMOOTHING, spread=0.0, folds=0
            )
            outcomes = [cross_validate(one, settings, "paper") for one in examples]
            counts = [f"{outcome.right}/{len(bench.posture_takes(seed))}" for seed, outcome in enumerate(outcomes)]
            totals.append((method, topology, *counts))
            if method == METHODS[0] and topology == TOPOLOGIES[0]:
                matrices = [matrix(outcome) for outcome in outcomes]
    seeds = tuple(f"people {seed}" for seed in range(bench.seeds))
    tables = (
        Table(
            "Recognized in the paper's configuration; the paper: 332/360", ("poses by", "topology", *seeds), tuple(totals)
        ),
        *(_table(counts, seed) for seed, counts in enumerate(matrices)),
    )
    return Section("paper", "Table 2 in the paper's configuration", (str(__doc__),), tables)


def matrix(outcome: Outcome) -> Ints:
    """(15, 15) counts [performed, recognized] in the order of POSTURES."""
    counts = np.zeros((len(POSTURES), len(POSTURES)), dtype=np.int64)
    for answer in outcome.answers:
        counts[POSTURES.index(outcome.labels[answer.true]), POSTURES.index(outcome.labels[answer.given])] += 1
    return counts


def _table(counts: Ints, seed: int) -> Table:
    rows = [
        (f"{number + 1} {posture}", *(int(count) or "" for count in counts[number]), PAPER[number])
        for number, posture in enumerate(POSTURES)
    ]
    columns = ("performed", *(str(number + 1) for number in range(len(POSTURES))), "paper")
    return Table(
        f"Recognized as, {METHODS[0]}, {TOPOLOGIES[0]}, people {seed}; last column: right in the paper",
        columns,
        tuple(rows),
    )
