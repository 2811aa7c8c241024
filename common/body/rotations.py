"""Rotation matrices as Euler angles, rotation vectors and unit quaternions, and back."""

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.jit import leaf_kernel

GIMBAL_LOCK = 1e-6  # cosine of the middle Euler angle at and below which the outer two axes coincide; chosen by hand
SMALL_ANGLE = 1e-8  # radians, below which the limit of Rodrigues' formula is used; its error there is below 1e-16
TINY = 1e-9  # added to no result: lower bound of divisors, so that zero vectors and half turns give finite numbers


def euler_to_matrix(axes: str, angles: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) R_1(a_1) R_2(a_2) ... about `axes`, such as "zxy", outermost first.

    angles: (..., len(axes)) radians.
    """
    result: Floats = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for k, axis in enumerate(axes):
        result = result @ _about(axis, angles[..., k])
    return result


def matrix_to_euler(axes: str, rotations: Floats, near: Floats) -> Floats:
    """Euler angles (n, 3) of `rotations` (n, 3, 3) about three different `axes`, nearest to `near` (n, 3), radians.

    Of the two solutions, and of their full turns, the nearer one is returned.  In gimbal lock the first angle is that of
    `near`.
    """
    i, j, _, sign = _order(axes)
    first, middle, last = cardan_angles(axes, rotations).T
    locked = np.hypot(rotations[:, i, i], rotations[:, i, j]) < GIMBAL_LOCK
    first = np.where(locked, near[:, 0], first)
    rest = np.swapaxes(euler_to_matrix(axes[:2], np.stack([first, middle], axis=-1)), -1, -2) @ rotations
    last = np.where(locked, np.arctan2(sign * rest[:, j, i], rest[:, i, i]), last)
    one = _within_half_a_turn(np.stack([first, middle, last], axis=-1), near)
    # (a + pi, pi - b, c + pi) is the same rotation.
    other = _within_half_a_turn(np.stack([first + np.pi, np.pi - middle, last + np.pi], axis=-1), near)
    nearer = np.abs(other - near).sum(axis=-1) < np.abs(one - near).sum(axis=-1)
    return np.where((nearer & ~locked)[:, None], other, one)


def cardan_angles(axes: str, rotations: Floats) -> Floats:
    """Angles (n, 3), radians, about three different intrinsic `axes`, the second one within a quarter turn.

    rotations: (n, 3, 3).
    """
    i, j, k, sign = _order(axes)
    first = np.arctan2(-sign * rotations[:, j, k], rotations[:, k, k])
    middle = np.arctan2(sign * rotations[:, i, k], np.hypot(rotations[:, i, i], rotations[:, i, j]))
    last = np.arctan2(-sign * rotations[:, i, j], rotations[:, i, i])
    return np.stack([first, middle, last], axis=-1)


def _order(axes: str) -> tuple[int, int, int, float]:
    """Indices of three different axes, and the sign of their permutation."""
    i, j, k = ("xyz".index(axis) for axis in axes)
    return i, j, k, 1.0 if (j - i) % 3 == 1 else -1.0


def _about(axis: str, angle: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) about one axis by `angle` (...) radians."""
    a = "xyz".index(axis)
    i, j = (a + 1) % 3, (a + 2) % 3
    result = np.zeros((*angle.shape, 3, 3))
    result[..., a, a] = 1.0
    result[..., i, i] = result[..., j, j] = np.cos(angle)
    result[..., j, i] = np.sin(angle)
    result[..., i, j] = -np.sin(angle)
    return result


def _within_half_a_turn(angles: Floats, near: Floats) -> Floats:
    """Angles equal to `angles` modulo a full turn, each within half a turn of `near`."""
    result: Floats = angles + 2 * np.pi * np.round((near - angles) / (2 * np.pi))
    return result


@leaf_kernel
def vector_to_matrix(vector: Floats, out: Floats) -> None:
    """Write the rotation matrix `out` (3, 3) of a rotation vector (3,) in radians.  Rodrigues' formula."""
    x, y, z = vector[0], vector[1], vector[2]
    angle = np.sqrt(x * x + y * y + z * z)
    if angle < SMALL_ANGLE:
        a, b = 1.0, 0.5
    else:
        a = np.sin(angle) / angle
        b = (1.0 - np.cos(angle)) / (angle * angle)
    c = np.cos(angle)
    out[0, 0] = c + b * x * x
    out[0, 1] = b * x * y - a * z
    out[0, 2] = b * x * z + a * y
    out[1, 0] = b * x * y + a * z
    out[1, 1] = c + b * y * y
    out[1, 2] = b * y * z - a * x
    out[2, 0] = b * x * z - a * y
    out[2, 1] = b * y * z + a * x
    out[2, 2] = c + b * z * z


@leaf_kernel
def matrix_to_vector(rotation: Floats, out: Floats) -> None:
    """Write the rotation vector `out` (3,) of a rotation matrix (3, 3), of length 0 to pi, by way of its quaternion."""
    trace = rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    if trace > 0.0:
        w = 1.0 + trace
        x = rotation[2, 1] - rotation[1, 2]
        y = rotation[0, 2] - rotation[2, 0]
        z = rotation[1, 0] - rotation[0, 1]
    elif rotation[0, 0] >= rotation[1, 1] and rotation[0, 0] >= rotation[2, 2]:
        w = rotation[2, 1] - rotation[1, 2]
        x = 1.0 + rotation[0, 0] - rotation[1, 1] - rotation[2, 2]
        y = rotation[0, 1] + rotation[1, 0]
        z = rotation[0, 2] + rotation[2, 0]
    elif rotation[1, 1] >= rotation[2, 2]:
        w = rotation[0, 2] - rotation[2, 0]
        x = rotation[0, 1] + rotation[1, 0]
        y = 1.0 - rotation[0, 0] + rotation[1, 1] - rotation[2, 2]
        z = rotation[1, 2] + rotation[2, 1]
    else:
        w = rotation[1, 0] - rotation[0, 1]
        x = rotation[0, 2] + rotation[2, 0]
        y = rotation[1, 2] + rotation[2, 1]
        z = 1.0 - rotation[0, 0] - rotation[1, 1] + rotation[2, 2]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = np.sqrt(x * x + y * y + z * z)
    scale = 2.0 * np.arctan2(sine, w) / sine if sine > SMALL_ANGLE * w else 2.0 / w
    out[0], out[1], out[2] = scale * x, scale * y, scale * z


def _outer_products() -> tuple[Floats, Floats]:
    """Factors (9, 16) and constants (16,) of 4 q q^T, which is linear in the rotation matrix R; q as x, y, z, w."""
    factors, constants = np.zeros((3, 3, 4, 4)), np.eye(4)
    for i in range(3):
        for k in range(4):  # the diagonal: 4 x^2 = 1 + R00 - R11 - R22, and 4 w^2 = 1 + trace
            factors[i, i, k, k] = 1.0 if k in (i, 3) else -1.0
        j, k = (i + 1) % 3, (i + 2) % 3
        for row, column in ((j, k), (k, j)):  # 4 y z = R12 + R21
            factors[j, k, row, column] = factors[k, j, row, column] = 1.0
        for row, column in ((i, 3), (3, i)):  # 4 x w = R21 - R12
            factors[k, j, row, column], factors[j, k, row, column] = 1.0, -1.0
    return factors.reshape(9, 16), constants.ravel()


_FACTORS, _CONSTANTS = _outer_products()


def matrix_to_quaternion(rotations: Floats) -> Floats:
    """Unit quaternions (n, 4) x, y, z, w of rotation matrices (n, 3, 3); their largest component is positive."""
    products = (rotations.reshape(-1, 9) @ _FACTORS + _CONSTANTS).reshape(-1, 4, 4)
    rows = np.arange(len(products))
    largest = np.argmax(products[:, (0, 1, 2, 3), (0, 1, 2, 3)], axis=1)
    found = products[rows, largest]
    unit: Floats = found / np.sqrt(np.sum(found * found, axis=1, keepdims=True))
    return unit


def unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) scaled to length 1; zero vectors stay zero."""
    result: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), TINY)
    return result


def perpendicular(vectors: Floats, axis: Floats) -> Floats:
    """Component of `vectors` (..., 3) perpendicular to unit axes (..., 3)."""
    result: Floats = vectors - np.sum(vectors * axis, axis=-1, keepdims=True) * axis
    return result


def shortest_rotation(start: Floats, end: Floats) -> Floats:
    """Rotations (..., 3, 3) by the smallest angle that map unit vectors `start` (..., 3) to `end` (..., 3)."""
    start, end = np.broadcast_arrays(start, end)
    x, y, z = np.moveaxis(np.cross(start, end), -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack([np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], axis=-2)
    cosine = np.sum(start * end, axis=-1)[..., None, None]
    result: Floats = np.eye(3) + skew + skew @ skew / np.maximum(1.0 + cosine, TINY)
    return result
