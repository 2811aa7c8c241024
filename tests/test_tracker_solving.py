"""Cholesky against numpy's own solver."""

import numpy as np
import pytest

from services.tracker.solving import marginal, solve


@pytest.mark.parametrize("n", [1, 2, 30, 161])
def test_positive_definite_equations_are_solved(n: int) -> None:
    rng = np.random.default_rng(n)
    half = rng.normal(size=(n, n + 3))
    a, b = half @ half.T, rng.normal(size=n)
    found = b.copy()
    assert solve(a.copy(), found)
    assert a @ found == pytest.approx(b, abs=1e-6)


def test_others_are_refused() -> None:
    assert not solve(np.diag([1.0, -1.0]), np.ones(2))
    assert not marginal(np.diag([1.0, 0.0]), np.ones(2), 1, np.empty((1, 1)), np.empty(1))


def test_what_the_first_unknowns_are_told_is_the_solution_of_all() -> None:
    rng = np.random.default_rng(5)
    half = rng.normal(size=(12, 20))
    a, b = half @ half.T, rng.normal(size=12)
    information, pull = np.empty((4, 4)), np.empty(4)
    assert marginal(a, b, 4, information, pull)
    assert np.linalg.solve(information, pull) == pytest.approx(np.linalg.solve(a, b)[:4], abs=1e-9)
