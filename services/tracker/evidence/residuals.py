"""Weights of residuals, and the wrench of one."""

from typing import NamedTuple

from zenocap.common.arrays import Floats
from zenocap.common.jit import inlined_kernel, leaf_kernel
from zenocap.services.tracker.parameters import LATERAL_SCALE_M


class Weights(NamedTuple):
    """Weights of residuals.

    spread: residual beyond which the gradient is constant, metres.  limit: residual beyond which it is zero, metres.
    precision: (6 + d,) 1 / variance about the target pose: 1 / m^2, then 1 / rad^2.  ray_weight: weight of one ray.
    """

    spread: float
    limit: float
    precision: Floats
    ray_weight: float


@inlined_kernel
def robust_weight(distance: float, gap: float, spread: float, limit: float) -> float:
    """Weight of a ray in 1 / m^2: the gradient grows up to a gap of `spread` metres, then stays; zero beyond `limit`.

    A ray that passes beside its contact, rather than before or behind it, has less weight.
    """
    aside = (distance * distance - gap * gap) / (LATERAL_SCALE_M * LATERAL_SCALE_M)
    weight = min(1.0, spread / max(abs(gap), 1e-9)) / (spread * spread * (1.0 + max(aside, 0.0)))
    return weight if distance < limit else 0.0


@leaf_kernel
def add_residual(
    x: float, y: float, z: float, found: Floats, weight: float, wrench: Floats, matrix: Floats, gradient: Floats
) -> None:
    """Add one residual to a part's wrench matrix and gradient.

    x, y, z: sample of the body relative to the root, metres.  found: (4,) gap (m), unit direction to close it.
    """
    gap, n0, n1, n2 = found[0], found[1], found[2], found[3]
    wrench[0], wrench[1], wrench[2] = n0, n1, n2
    wrench[3], wrench[4], wrench[5] = y * n2 - z * n1, z * n0 - x * n2, x * n1 - y * n0
    for row in range(6):
        gradient[row] += weight * gap * wrench[row]
        for column in range(row + 1):
            matrix[row, column] += weight * wrench[row] * wrench[column]
