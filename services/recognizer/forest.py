"""A forest of decision trees over the description of a segment: how many trees vote for each posture."""

# Paper (replaced): [Two-view 5.2] takes the likeliest model; by default a forest decides on the whole segment.

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.jit import kernel
from zenocap.services.recognizer.false_alarms import FalseAlarms

FEATURE, THRESHOLD, OTHER = 0, 1, 2  # columns of a node
LEAF = -1.0  # in FEATURE; OTHER is then the index of a posture, or their number: none of them


@dataclass(frozen=True, eq=False)
class Forest:
    """Trees that vote.

    nodes: (trees, nodes, 3): index of a value of `segment_description`, threshold, and the node that follows where the
    value is larger; otherwise the next node follows.  Values are compared in single precision.  A tree begins at its
    node 0, and rows after its last node are leaves.
    thresholds: (n,) least share of the trees with which a posture is accepted.
    alarms: false postures in the background of the training; None: not measured.
    """

    nodes: Floats
    thresholds: Floats
    alarms: FalseAlarms | None = None


def votes_of(forest: Forest, values: Floats) -> Ints:
    """(n + 1,) trees that vote for each posture, and for none; values: (VALUES,) of a segment."""
    return count_votes(forest.nodes, values.astype(np.float32), len(forest.thresholds) + 1)


@kernel
def count_votes(nodes: Floats, values: Floats, count: int) -> Ints:
    """(count,) votes of trees (trees, nodes, 3) for single-precision values."""
    votes = np.zeros(count, dtype=np.int64)
    for tree in range(nodes.shape[0]):
        node = 0
        while nodes[tree, node, 0] >= 0.0:
            if values[int(nodes[tree, node, 0])] <= nodes[tree, node, 1]:
                node += 1
            else:
                node = int(nodes[tree, node, 2])
        votes[int(nodes[tree, node, 2])] += 1
    return votes
