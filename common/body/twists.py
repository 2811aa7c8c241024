"""How a limb is turned about itself: seen in the plane of its hinge when bent, carried over in time when straight."""

import numpy as np
from scipy.linalg import solveh_banded

from common.body.anatomy import Floats

CLEAR = np.sin(np.radians(15.0))  # sine of the bend at which the hinge's plane counts as much as one in NEIGHBOURS
NEIGHBOURS = 0.3  # weight of turning as in the frame before and after
NATURAL = 2e-3  # weight of the turn that the limb has of itself: it decides only where nothing else does
TINY = 1e-9


def unit(vectors: Floats) -> Floats:
    """(..., 3) at length one; zero stays zero."""
    result: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), TINY)
    return result


def across(vectors: Floats, axis: Floats) -> Floats:
    """The part of (..., 3) vectors perpendicular to unit axes (..., 3)."""
    result: Floats = vectors - np.sum(vectors * axis, axis=-1, keepdims=True) * axis
    return result


def swing(start: Floats, end: Floats) -> Floats:
    """(..., 3, 3) the smallest rotations that take unit vectors start (..., 3) to end (..., 3)."""
    start, end = np.broadcast_arrays(start, end)
    x, y, z = np.moveaxis(np.cross(start, end), -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack([np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], axis=-2)
    cosine = np.sum(start * end, axis=-1)[..., None, None]
    result: Floats = np.eye(3) + skew + skew @ skew / np.maximum(1.0 + cosine, TINY)
    return result


def hinge_axes(direction: Floats, seen: tuple[tuple[Floats, float, int], ...], natural: Floats) -> Floats:
    """Unit hinge axes (n, 3) perpendicular to a limb's unit directions (n, 3), smooth from row to row.

    seen: what tells of the axis: vectors (n, 3) along it, as long as they are sure (1 is certain), the weight of a
    certain one, and the power of the length with which it counts.  natural: (n, 3) the axis of a limb of which nothing
    else is known.

    With the axes as complex numbers c (angle about the direction), least squares of sum w |c_t - seen_t|^2
    + NATURAL |c_t - natural_t|^2 + NEIGHBOURS |c_t+1 - c_t|^2, rows compared after the smallest rotation that takes
    one direction to the next.
    """
    first = unit(across(natural, direction))
    second = np.cross(direction, first)
    wanted = np.full(len(direction), NATURAL, dtype=np.complex128)
    diagonal = np.full(len(direction), NATURAL)
    for vectors, weight, power in seen:
        found = np.sum(vectors * first, axis=-1) + 1j * np.sum(vectors * second, axis=-1)
        sure = weight * np.abs(found) ** power
        wanted += sure * found / np.maximum(np.abs(found), TINY)
        diagonal += sure
    bands = np.zeros((min(2, len(direction)), len(direction)), dtype=np.complex128)
    if len(direction) > 1:
        carried = np.einsum("nij,nj->ni", swing(direction[:-1], direction[1:]), first[:-1])
        turn = np.sum(carried * first[1:], axis=-1) + 1j * np.sum(carried * second[1:], axis=-1)
        bands[0, 1:] = -NEIGHBOURS * np.conj(turn)
        diagonal[1:] += NEIGHBOURS
        diagonal[:-1] += NEIGHBOURS
    bands[-1] = diagonal
    turned = solveh_banded(bands, wanted)
    axes: Floats = unit(first * turned.real[:, None] + second * turned.imag[:, None])
    return axes
