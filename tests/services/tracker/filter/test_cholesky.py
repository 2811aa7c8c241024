"""Cholesky against numpy's own solver."""

import numpy as np
import pytest

from zenocap.services.tracker.filter.cholesky import cholesky_solve, schur_complement


@pytest.mark.parametrize("n", [1, 2, 30, 161])
def test_positive_definite_equations_are_solved(n: int) -> None:
    rng = np.random.default_rng(n)
    half = rng.normal(size=(n, n + 3))
    a, b = half @ half.T, rng.normal(size=n)
    found = b.copy()
    assert cholesky_solve(a.copy(), found)
    assert a @ found == pytest.approx(b, abs=1e-6)


def test_indefinite_equations_are_refused() -> None:
    assert not cholesky_solve(np.diag([1.0, -1.0]), np.ones(2))
    assert not schur_complement(np.diag([1.0, 0.0]), np.ones(2), 1, np.empty((1, 1)), np.empty(1))


def test_schur_complement_gives_the_joint_solution() -> None:
    rng = np.random.default_rng(5)
    half = rng.normal(size=(12, 20))
    a, b = half @ half.T, rng.normal(size=12)
    information, gradient = np.empty((4, 4)), np.empty(4)
    assert schur_complement(a, b, 4, information, gradient)
    assert np.linalg.solve(information, gradient) == pytest.approx(np.linalg.solve(a, b)[:4], abs=1e-9)
