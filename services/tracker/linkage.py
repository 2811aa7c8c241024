"""The body as a linkage: how every degree of freedom moves what hangs on it, and steps taken within the limits.

The hierarchy is that of [Hybrid Eq. 38-40]: what acts on a part acts on every joint between it and the root.
"""

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from common.body.rotation_vectors import rotation_of, vector_of
from services.tracker.model import Ints, Model, local_rotation

ROOT = 6  # degrees of freedom: position, then turns about the world's axes


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
def assemble(model: Model, screws: Floats, owner: Ints, matrices: Floats, pulls: Floats, a: Floats, b: Floats) -> None:
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


@njit(cache=True, error_model="numpy")
def _times_transposed(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b^T, (3, 3) each."""
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += a[row, k] * b[column, k]
            out[row, column] = total
