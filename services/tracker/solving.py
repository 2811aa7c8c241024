"""Positive definite equations, solved by Cholesky: the same digits whatever threads a library would use."""

import numpy as np
from numba import njit

from common.body.anatomy import Floats


@njit(cache=True, error_model="numpy")
def factored(a: Floats) -> bool:
    """The lower triangle of a (n, n) becomes its Cholesky factor; False when it is not positive definite."""
    n = a.shape[0]
    for j in range(n):
        total = a[j, j]
        for k in range(j):
            total -= a[j, k] * a[j, k]
        if not total > 0.0:
            return False
        a[j, j] = np.sqrt(total)
        for i in range(j + 1, n):
            value = a[i, j]
            for k in range(j):
                value -= a[i, k] * a[j, k]
            a[i, j] = value / a[j, j]
    return True


@njit(cache=True, error_model="numpy")
def substitute(factor: Floats, b: Floats) -> None:
    """b (n,) becomes the solution, of a factor (n, n) from `factored`."""
    n = b.shape[0]
    for i in range(n):
        for k in range(i):
            b[i] -= factor[i, k] * b[k]
        b[i] /= factor[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= factor[k, i] * b[k]
        b[i] /= factor[i, i]


@njit(cache=True, error_model="numpy")
def solve(a: Floats, b: Floats) -> bool:
    """b (n,) becomes a^-1 b, the lower triangle of a (n, n) its factor; False when a is not positive definite."""
    if not factored(a):
        return False
    substitute(a, b)
    return True


@njit(cache=True, error_model="numpy")
def marginal(a: Floats, b: Floats, kept: int, information: Floats, pull: Floats) -> bool:
    """What equations (n, n), (n,) say of their first `kept` unknowns once the others follow: the Schur complement.

    Writes information (kept, kept) and pull (kept,); False when the others' own equations are not positive definite.
    """
    others = a.shape[0] - kept
    factor = a[kept:, kept:].copy()
    if not factored(factor):
        return False
    column = np.empty(others)
    for j in range(kept):
        for k in range(others):
            column[k] = a[kept + k, j]
        substitute(factor, column)
        total = b[j]
        for k in range(others):
            total -= column[k] * b[kept + k]
        pull[j] = total
        for i in range(kept):
            value = a[i, j]
            for k in range(others):
                value -= a[i, kept + k] * column[k]
            information[i, j] = value
    return True
