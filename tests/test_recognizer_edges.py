"""Beginnings and ends of postures as numbers."""

import numpy as np
import pytest

from services.recognizer.edges import edges_of, reach_of


def test_edges_are_the_means_of_the_first_and_last_frames_by_posture() -> None:
    up, down = np.array([[0.0], [2.0], [8.0], [4.0]]), np.array([[1.0], [1.0], [1.0]])
    edges, calm, slow = edges_of([0, 1], 2, [up, down], 10.0)
    np.testing.assert_allclose(edges, [[[1.0], [6.0]], [[1.0], [1.0]]])
    distances = [1, 1, 2, 2, 0, 0, 0, 0]
    assert calm == pytest.approx(np.quantile(distances, 0.95))
    assert slow == pytest.approx(np.quantile([20.0, 40.0, 0.0, 0.0], 0.95))


def test_reach_is_what_nearly_all_examples_come_to() -> None:
    vectors = [np.array([[1.0], [1.0 + far], [1.0]]) for far in (*range(1, 21), 100)]
    reach = reach_of([0] * 20 + [1], 2, vectors)
    assert reach[0] == pytest.approx(np.quantile(np.arange(1, 21), 0.05))
    assert reach[1] == 100.0
