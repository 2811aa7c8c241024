"""Rotations as unit quaternions."""

import numpy as np

from common.body.anatomy import Floats


def _outer_products() -> tuple[Floats, Floats]:
    """4 q q^T of a rotation matrix R is linear in R: (9, 16) factors of R row by row, and (16,) added; q as x, y, z, w."""
    factors, added = np.zeros((3, 3, 4, 4)), np.eye(4)
    for i in range(3):
        for k in range(4):  # the diagonal: 4 x^2 = 1 + R00 - R11 - R22, and 4 w^2 = 1 + trace
            factors[i, i, k, k] = 1.0 if k in (i, 3) else -1.0
        j, k = (i + 1) % 3, (i + 2) % 3
        for row, column in ((j, k), (k, j)):  # 4 y z = R12 + R21
            factors[j, k, row, column] = factors[k, j, row, column] = 1.0
        for row, column in ((i, 3), (3, i)):  # 4 x w = R21 - R12
            factors[k, j, row, column], factors[j, k, row, column] = 1.0, -1.0
    return factors.reshape(9, 16), added.ravel()


_FACTORS, _ADDED = _outer_products()


def quaternions(rotations: Floats) -> Floats:
    """(n, 4) unit quaternions x, y, z, w of rotation matrices (n, 3, 3); their largest component is positive."""
    products = (rotations.reshape(-1, 9) @ _FACTORS + _ADDED).reshape(-1, 4, 4)
    rows = np.arange(len(products))
    largest = np.argmax(products[:, (0, 1, 2, 3), (0, 1, 2, 3)], axis=1)
    found = products[rows, largest]
    unit: Floats = found / np.sqrt(np.sum(found * found, axis=1, keepdims=True))
    return unit
