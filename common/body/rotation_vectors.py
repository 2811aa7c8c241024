"""Rotation vectors: axis times angle, the coordinates in which no joint of the body is singular within its range."""

import numpy as np
from numba import njit

from common.body.anatomy import Floats

TINY = 1e-8


@njit(cache=True, error_model="numpy")
def rotation_of(vector: Floats, out: Floats) -> None:
    """Write the rotation matrix out (3, 3) of a rotation vector (3,) in radians.  Rodrigues' formula."""
    x, y, z = vector[0], vector[1], vector[2]
    angle = np.sqrt(x * x + y * y + z * z)
    if angle < TINY:
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


@njit(cache=True, error_model="numpy")
def vector_of(rotation: Floats, out: Floats) -> None:
    """Write the rotation vector out (3,) of a rotation matrix (3, 3), of length 0 to pi, by way of its quaternion."""
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
    scale = 2.0 * np.arctan2(sine, w) / sine if sine > TINY * w else 2.0 / w
    out[0], out[1], out[2] = scale * x, scale * y, scale * z
