"""Three angles about three different axes, and back, without jumps from row to row."""

import numpy as np

from common.body.anatomy import Floats

GIMBAL = 1e-6  # cosine of the middle angle below which the outer two are one


def rotation(axes: str, angles: Floats) -> Floats:
    """R_1(a_1) R_2(a_2) ... about `axes`, such as "zxy", outermost first.

    angles: (..., len(axes)) radians.  Returns (..., 3, 3).
    """
    result: Floats = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for k, axis in enumerate(axes):
        result = result @ _about(axis, angles[..., k])
    return result


def angles_near(axes: str, rotations: Floats, near: Floats) -> Floats:
    """The angles of `rotations` (n, 3, 3) about three different `axes` that are nearest to `near` (n, 3), radians.

    Of the two solutions, and of their full turns, the nearer.  Where the outer two axes fall together (gimbal lock) the
    first angle is that of `near`.
    """
    i, j, k = ("xyz".index(axis) for axis in axes)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    middle = np.arctan2(sign * rotations[:, i, k], np.hypot(rotations[:, i, i], rotations[:, i, j]))
    first = np.arctan2(-sign * rotations[:, j, k], rotations[:, k, k])
    last = np.arctan2(-sign * rotations[:, i, j], rotations[:, i, i])
    locked = np.hypot(rotations[:, i, i], rotations[:, i, j]) < GIMBAL
    first = np.where(locked, near[:, 0], first)
    rest = np.swapaxes(rotation(axes[:2], np.stack([first, middle], axis=-1)), -1, -2) @ rotations
    last = np.where(locked, np.arctan2(sign * rest[:, j, i], rest[:, i, i]), last)
    one = _within_half_a_turn(np.stack([first, middle, last], axis=-1), near)
    # (a + pi, pi - b, c + pi) is the same rotation.
    other = _within_half_a_turn(np.stack([first + np.pi, np.pi - middle, last + np.pi], axis=-1), near)
    nearer = np.abs(other - near).sum(axis=-1) < np.abs(one - near).sum(axis=-1)
    return np.where((nearer & ~locked)[:, None], other, one)


def _about(axis: str, angle: Floats) -> Floats:
    a = "xyz".index(axis)
    i, j = (a + 1) % 3, (a + 2) % 3
    result = np.zeros((*angle.shape, 3, 3))
    result[..., a, a] = 1.0
    result[..., i, i] = result[..., j, j] = np.cos(angle)
    result[..., j, i] = np.sin(angle)
    result[..., i, j] = -np.sin(angle)
    return result


def _within_half_a_turn(angles: Floats, near: Floats) -> Floats:
    result: Floats = angles + 2 * np.pi * np.round((near - angles) / (2 * np.pi))
    return result
