"""Refinement of a pose: damped Gauss-Newton on the gaps between scene and body, from one wrench matrix a part.

The hierarchy is that of [Hybrid Eq. 38-40]: what acts on a part acts on every joint between it and the root.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from common.body.anatomy import Floats
from common.body.rotation_vectors import rotation_of, vector_of
from services.tracker.closest import FOUND, influence, nearest
from services.tracker.model import Ints, Model, local_rotation, place

ROOT = 6


class Weights(NamedTuple):
    """spread: of a good gap, metres; beyond it the pull stays the same.  limit: no pull beyond, metres.
    precision: (6 + d,) 1 / variance that holds the pose at its target: metres, then radians.  share: of one ray."""

    spread: float
    limit: float
    precision: Floats
    share: float


@njit(cache=True, error_model="numpy")
def gather(model: Model, frames: Floats, rays: Floats, weights: Weights, matrices: Floats, pulls: Floats) -> float:
    """Add up every part's wrench matrix (p, 6, 6) and pull (p, 6) about the root's origin; mean squared gap."""
    matrices[:] = 0.0
    pulls[:] = 0.0
    found, wrench = np.empty(FOUND), np.empty(6)
    total = 0.0
    for i in range(rays.shape[0]):
        part = nearest(model, frames, rays[i], found)
        gap = found[1]
        total += min(found[0], weights.limit) ** 2
        weight = weights.share * influence(found, weights.spread, weights.limit)
        if weight == 0.0:
            continue
        x, y, z = found[2] - frames[0, 0, 3], found[3] - frames[0, 1, 3], found[4] - frames[0, 2, 3]
        n0, n1, n2 = found[6], found[7], found[8]
        wrench[0], wrench[1], wrench[2] = n0, n1, n2
        wrench[3], wrench[4], wrench[5] = y * n2 - z * n1, z * n0 - x * n2, x * n1 - y * n0
        for row in range(6):
            pulls[part, row] += weight * gap * wrench[row]
            for column in range(row + 1):
                matrices[part, row, column] += weight * wrench[row] * wrench[column]
    return float(total / max(rays.shape[0], 1))


@njit(cache=True, error_model="numpy")
def screws_of(model: Model, frames: Floats, screws: Floats, owner: Ints) -> None:
    """Motion about the root's origin of every degree of freedom, (6 + d, 6): linear, angular; and the part it moves."""
    screws[:] = 0.0
    for k in range(3):
        screws[k, k] = 1.0
        screws[3 + k, 3 + k] = 1.0
        owner[k] = 0
        owner[3 + k] = 0
    for part in range(1, frames.shape[0]):
        kind = model.kind[part]
        if kind == 0:
            continue
        cx, cy, cz = (
            frames[part, 0, 3] - frames[0, 0, 3],
            frames[part, 1, 3] - frames[0, 1, 3],
            frames[part, 2, 3] - frames[0, 2, 3],
        )
        for n in range(kind):
            row = ROOT + model.first[part] + n
            owner[row] = part
            if kind == 1:
                axis = model.axis[part]
                wx, wy, wz = frames[part, 0, axis], frames[part, 1, axis], frames[part, 2, axis]
            else:
                wx, wy, wz = 1.0 * (n == 0), 1.0 * (n == 1), 1.0 * (n == 2)
            screws[row, 0] = cy * wz - cz * wy
            screws[row, 1] = cz * wx - cx * wz
            screws[row, 2] = cx * wy - cy * wx
            screws[row, 3], screws[row, 4], screws[row, 5] = wx, wy, wz


@njit(cache=True, error_model="numpy")
def _assemble(model: Model, screws: Floats, owner: Ints, matrices: Floats, pulls: Floats, a: Floats, b: Floats) -> None:
    """The normal equations of all degrees of freedom from the parts' wrenches, leaves first."""
    parts, dof = matrices.shape[0], screws.shape[0]
    for part in range(parts - 1, 0, -1):
        up = model.parent[part]
        for row in range(6):
            pulls[up, row] += pulls[part, row]
            for column in range(row + 1):
                matrices[up, row, column] += matrices[part, row, column]
    moved = np.empty(6)
    a[:] = 0.0
    for k in range(dof):
        part = owner[k]
        total = 0.0
        for row in range(6):
            total += screws[k, row] * pulls[part, row]
            value = 0.0
            for column in range(6):
                value += (matrices[part, row, column] if column <= row else matrices[part, column, row]) * screws[k, column]
            moved[row] = value
        b[k] = total
        up = part
        while up >= 0:
            kind = ROOT if up == 0 else model.kind[up]
            start = 0 if up == 0 else ROOT + model.first[up]
            for n in range(kind):
                other = start + n
                if other <= k:
                    value = 0.0
                    for row in range(6):
                        value += screws[other, row] * moved[row]
                    a[k, other] = value
            up = model.parent[up]


@njit(cache=True, error_model="numpy")
def _solve(a: Floats, b: Floats) -> bool:
    """b becomes a^-1 b by Cholesky in the lower triangle; False when a is not positive definite."""
    n = b.shape[0]
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
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@njit(cache=True, error_model="numpy")
def refine(
    model: Model,
    rays: Floats,
    weights: Weights,
    iterations: int,
    position: Floats,
    rotation: Floats,
    values: Floats,
    target_position: Floats,
    target_rotation: Floats,
    target_values: Floats,
) -> float:
    """Move a pose in place: position (3,), rotation (3, 3) and values (d,), held near its target.

    Returns the mean squared distance before the last step.
    """
    parts, dof = model.parent.shape[0], ROOT + values.shape[0]
    frames = np.empty((parts, 3, 4))
    matrices, pulls = np.empty((parts, 6, 6)), np.empty((parts, 6))
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    a, b = np.empty((dof, dof)), np.empty(dof)
    error = 0.0
    for _ in range(iterations):
        place(model, position, rotation, values, frames)
        error = gather(model, frames, rays, weights, matrices, pulls)
        screws_of(model, frames, screws, owner)
        _assemble(model, screws, owner, matrices, pulls, a, b)
        for k in range(dof):
            a[k, k] += weights.precision[k] + 1e-6
        hold(
            model, frames, position, rotation, values,
            target_position, target_rotation, target_values, weights.precision, b,
        )  # fmt: skip
        if not _solve(a, b):
            return error
        move(model, frames, b, position, rotation, values)
    return error


@njit(cache=True, error_model="numpy")
def hold(
    model: Model,
    frames: Floats,
    position: Floats,
    rotation: Floats,
    values: Floats,
    target_position: Floats,
    target_rotation: Floats,
    target_values: Floats,
    precision: Floats,
    b: Floats,
) -> None:
    """Add to b (6 + d,) the pull from a pose to its target, in the world's axes like every step."""
    turn, local, other, vector = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k in range(3):
        b[k] += precision[k] * (target_position[k] - position[k])
    _times_transposed(target_rotation, rotation, other)  # from here to the target
    vector_of(other, vector)
    for k in range(3):
        b[3 + k] += precision[3 + k] * vector[k]
    for part in range(1, frames.shape[0]):
        start = model.first[part]
        if model.kind[part] == 1:
            b[ROOT + start] += precision[ROOT + start] * (target_values[start] - values[start])
        elif model.kind[part] == 3:
            local_rotation(model, part, target_values, turn, local)
            local_rotation(model, part, values, turn, other)
            _times_transposed(local, other, turn)
            vector_of(turn, vector)
            up = model.parent[part]
            for row in range(3):
                pull = 0.0
                for column in range(3):
                    pull += frames[up, row, column] * vector[column]
                b[ROOT + start + row] += precision[ROOT + start + row] * pull


@njit(cache=True, error_model="numpy")
def _times_transposed(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b^T, (3, 3) each."""
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += a[row, k] * b[column, k]
            out[row, column] = total


@njit(cache=True, error_model="numpy")
def move(model: Model, frames: Floats, step: Floats, position: Floats, rotation: Floats, values: Floats) -> None:
    """Take a step (6 + d,) in the world's axes, within the limits.  [Hybrid Eq. 41]"""
    turn, local, other, vector = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k in range(3):
        position[k] += step[k]
    rotation_of(step[3:6], turn)
    _times(turn, rotation, other)
    for row in range(3):
        for column in range(3):
            rotation[row, column] = other[row, column]
    for part in range(1, frames.shape[0]):
        start, kind = model.first[part], model.kind[part]
        if kind == 1:
            values[start] += step[ROOT + start]
        elif kind == 3:
            up = model.parent[part]
            for row in range(3):
                vector[row] = 0.0
                for k in range(3):
                    vector[row] += frames[up, k, row] * step[ROOT + start + k]
            rotation_of(vector, turn)
            local_rotation(model, part, values, other, local)
            _times(turn, local, other)
            for row in range(3):  # local = reference^T other
                for column in range(3):
                    total = 0.0
                    for k in range(3):
                        total += model.reference[part, k, row] * other[k, column]
                    local[row, column] = total
            vector_of(local, vector)
            for k in range(3):
                values[start + k] = vector[k]
    for k in range(values.shape[0]):
        values[k] = min(max(values[k], model.low[k]), model.high[k])


@njit(cache=True, error_model="numpy")
def _times(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b, (3, 3) each."""
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += a[row, k] * b[k, column]
            out[row, column] = total


@njit(cache=True, error_model="numpy", parallel=True)
def refine_all(
    model: Model,
    rays: Floats,
    weights: Weights,
    iterations: int,
    positions: Floats,
    rotations: Floats,
    values: Floats,
    errors: Floats,
) -> None:
    """Refine every particle (n, ...) in place towards the scene, each held near where it began."""
    for k in prange(positions.shape[0]):
        errors[k] = refine(
            model, rays, weights, iterations, positions[k], rotations[k], values[k],
            positions[k].copy(), rotations[k].copy(), values[k].copy(),
        )  # fmt: skip
