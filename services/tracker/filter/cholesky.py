"""Cholesky solution of positive definite equations, equal for any number of threads."""

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.jit import kernel, leaf_kernel


@leaf_kernel
def cholesky_factor(a: Floats) -> bool:
    """Replace the lower triangle of a (n, n) by its Cholesky factor; False when a is not positive definite."""
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


@leaf_kernel
def cholesky_substitute(factor: Floats, b: Floats) -> None:
    """Replace b (n,) by the solution, given a factor (n, n) from `cholesky_factor`."""
    n = b.shape[0]
    for i in range(n):
        for k in range(i):
            b[i] -= factor[i, k] * b[k]
        b[i] /= factor[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= factor[k, i] * b[k]
        b[i] /= factor[i, i]


@leaf_kernel
def cholesky_solve(a: Floats, b: Floats) -> bool:
    """Replace b (n,) by a^-1 b and the lower triangle of a (n, n) by its factor; False unless a is positive definite."""
    if not cholesky_factor(a):
        return False
    cholesky_substitute(a, b)
    return True


@kernel
def schur_complement(a: Floats, b: Floats, kept: int, information: Floats, gradient: Floats) -> bool:
    """Marginal normal equations of the first `kept` unknowns of (n, n), (n,): the Schur complement.

    Writes information (kept, kept) and gradient (kept,); False when the other unknowns' block is not positive definite.
    """
    others = a.shape[0] - kept
    factor = a[kept:, kept:].copy()
    if not cholesky_factor(factor):
        return False
    column = np.empty(others)
    for j in range(kept):
        for k in range(others):
            column[k] = a[kept + k, j]
        cholesky_substitute(factor, column)
        total = b[j]
        for k in range(others):
            total -= column[k] * b[kept + k]
        gradient[j] = total
        for i in range(kept):
            value = a[i, j]
            for k in range(others):
                value -= a[i, kept + k] * column[k]
            information[i, j] = value
    return True
