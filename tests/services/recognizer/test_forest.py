"""Votes of a forest, compared with trees written by hand."""

import numpy as np
import pytest

from zenocap.services.recognizer.forest import LEAF, Forest, votes_of
from zenocap.services.recognizer.model import by_forest


def forest() -> Forest:
    """Two trees over two values: value 0 above 0.5 is posture 1; value 1 above -1 is posture 2, otherwise 0."""
    nodes = np.array(
        [[[0.0, 0.5, 2.0], [LEAF, 0.0, 0.0], [LEAF, 0.0, 1.0]], [[1.0, -1.0, 2.0], [LEAF, 0.0, 0.0], [LEAF, 0.0, 2.0]]]
    )
    return Forest(nodes, np.full(3, 0.6))


def test_every_tree_votes_once() -> None:
    assert votes_of(forest(), np.array([0.5, -1.0])).tolist() == [2, 0, 0, 0]
    assert votes_of(forest(), np.array([0.6, -1.0])).tolist() == [1, 1, 0, 0]
    assert votes_of(forest(), np.array([0.6, 0.0])).tolist() == [0, 1, 1, 0]


def test_values_are_compared_in_single_precision() -> None:
    assert votes_of(forest(), np.array([0.5 + 1e-12, -1.0])).tolist() == [2, 0, 0, 0]


def test_a_window_is_accepted_where_enough_trees_agree() -> None:
    agreed, divided = by_forest(forest(), np.array([0.0, -2.0])), by_forest(forest(), np.array([1.0, -2.0]))
    assert (agreed.best, agreed.accepted, divided.accepted) == (0, True, False)
    assert 1.0 - np.exp(-agreed.scores[0]) == pytest.approx(2.0 / 2.5)
    assert 1.0 - np.exp(-divided.scores[0]) == pytest.approx(1.0 / 2.5)
    assert 1.0 - np.exp(-agreed.margin) == pytest.approx(2.0 / 2.5)
    assert divided.margin == pytest.approx(0.0)
    assert np.exp(agreed.log_likelihoods).sum() == pytest.approx(1.0)


def test_a_window_is_rejected_where_more_trees_vote_for_none() -> None:
    leaves = np.array([[[LEAF, 0.0, 1.0]], [[LEAF, 0.0, 3.0]], [[LEAF, 0.0, 3.0]]])
    found = by_forest(Forest(leaves, np.full(3, 0.3)), np.zeros(2))
    assert (found.best, found.accepted) == (1, False)
    assert by_forest(Forest(leaves[:2], np.full(3, 0.3)), np.zeros(2)).accepted
