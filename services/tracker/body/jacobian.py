"""Geometric Jacobian as screws, normal equations over the kinematic tree, limited steps.

The hierarchy is that of [Hybrid Eq. 38-40]: a wrench on a part acts on every joint between it and the root.
"""

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.rotations import matrix_to_vector, vector_to_matrix
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, local_rotation

ROOT = 6  # degrees of freedom: position, then turns about the world's axes


@leaf_kernel
def joint_screws(model: BodyModel, frames: Floats, screws: Floats, owner: Ints) -> None:
    """Write the screw of every degree of freedom and the part that it moves.

    screws: (6 + d, 6) linear, angular, about the root's origin.  owner: (6 + d,).
    """
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


@kernel
def normal_equations(
    model: BodyModel, screws: Floats, owner: Ints, matrices: Floats, gradients: Floats, a: Floats, b: Floats
) -> None:
    """Write the normal equations a (n, n), lower triangle, and b (n,) from the wrenches of the parts, leaves first."""
    parts, dof = matrices.shape[0], screws.shape[0]
    for part in range(parts - 1, 0, -1):
        up = model.parent[part]
        for row in range(6):
            gradients[up, row] += gradients[part, row]
            for column in range(row + 1):
                matrices[up, row, column] += matrices[part, row, column]
    moved = np.empty(6)
    a[:] = 0.0
    for k in range(dof):
        part = owner[k]
        total = 0.0
        for row in range(6):
            total += screws[k, row] * gradients[part, row]
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


@kernel
def add_target_gradient(
    model: BodyModel, frames: Floats, pose: RootedPose, target: RootedPose, precision: Floats, b: Floats
) -> None:
    """Add to b (6 + d,) the gradient of a Gaussian at a target pose, in the world's axes like every step."""
    turn, local, other, vector = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k in range(3):
        b[k] += precision[k] * (target.position[k] - pose.position[k])
    _times_transposed(target.rotation, pose.rotation, other)  # from here to the target
    matrix_to_vector(other, vector)
    for k in range(3):
        b[3 + k] += precision[3 + k] * vector[k]
    for part in range(1, frames.shape[0]):
        start = model.first[part]
        if model.kind[part] == 1:
            b[ROOT + start] += precision[ROOT + start] * (target.values[start] - pose.values[start])
        elif model.kind[part] == 3:
            local_rotation(model, part, target.values, turn, local)
            local_rotation(model, part, pose.values, turn, other)
            _times_transposed(local, other, turn)
            matrix_to_vector(turn, vector)
            up = model.parent[part]
            for row in range(3):
                gradient = 0.0
                for column in range(3):
                    gradient += frames[up, row, column] * vector[column]
                b[ROOT + start + row] += precision[ROOT + start + row] * gradient


@kernel
def apply_step(model: BodyModel, frames: Floats, step: Floats, pose: RootedPose) -> None:
    """Apply a step (6 + d,) in the world's axes to a pose, within the limits.  [Hybrid Eq. 41]"""
    turn, local, other, vector = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for k in range(3):
        pose.position[k] += step[k]
    vector_to_matrix(step[3:6], turn)
    _times(turn, pose.rotation, other)
    for row in range(3):
        for column in range(3):
            pose.rotation[row, column] = other[row, column]
    for part in range(1, frames.shape[0]):
        start, kind = model.first[part], model.kind[part]
        if kind == 1:
            pose.values[start] += step[ROOT + start]
        elif kind == 3:
            _turn_socket(model, part, frames, step, pose, turn, local, other, vector)
    for k in range(pose.values.shape[0]):
        pose.values[k] = min(max(pose.values[k], model.low[k]), model.high[k])


@leaf_kernel
def _turn_socket(
    model: BodyModel, part: int, frames: Floats, step: Floats, pose: RootedPose,
    turn: Floats, local: Floats, other: Floats, vector: Floats,
) -> None:  # fmt: skip
    """Apply a step to a part with three axes.  turn, local, other: (3, 3), vector: (3,): scratch."""
    start, up = model.first[part], model.parent[part]
    for row in range(3):
        vector[row] = 0.0
        for k in range(3):
            vector[row] += frames[up, k, row] * step[ROOT + start + k]
    vector_to_matrix(vector, turn)
    local_rotation(model, part, pose.values, other, local)
    _times(turn, local, other)
    for row in range(3):  # local = reference^T other
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += model.reference[part, k, row] * other[k, column]
            local[row, column] = total
    matrix_to_vector(local, vector)
    for k in range(3):
        pose.values[start + k] = vector[k]


@leaf_kernel
def _times(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b, (3, 3) each."""
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += a[row, k] * b[k, column]
            out[row, column] = total


@leaf_kernel
def _times_transposed(a: Floats, b: Floats, out: Floats) -> None:
    """out = a b^T, (3, 3) each."""
    for row in range(3):
        for column in range(3):
            total = 0.0
            for k in range(3):
                total += a[row, k] * b[column, k]
            out[row, column] = total
