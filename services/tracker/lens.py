"""Lenses inside compiled loops: OpenCV's model from (x, y) = (X / Z, Y / Z) to pixels and back."""

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.camera.pinhole import Camera

Floats = NDArray[np.float64]

MATRIX = 5  # fx, skew, cx, fy, cy
TERMS = 12  # k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4
REACH = MATRIX + TERMS  # square of the largest radius at which the lens holds; 0: no distortion
LENGTH = REACH + 1
TURNS, EXACT = 40, 1e-10  # the fixed point that takes the distortion away: at most so many turns, or this near


def lens_of(camera: Camera) -> Floats:
    """(LENGTH,) the lens for `distorted` and `undistorted`.

    Beyond the image's corners a lens polynomial may fold back into it, so nothing beyond them is in the picture.
    Raises ValueError for a tilted sensor (the last two of 14 distortions).
    """
    lens = np.zeros(LENGTH)
    matrix, terms = camera.matrix, camera.distortions
    lens[:MATRIX] = matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[1, 1], matrix[1, 2]
    if np.any(terms[TERMS:]):
        raise ValueError(f"camera {camera.name}: distortions[12:] = {terms[TERMS:]}: allowed: 0, the sensor is not tilted")
    lens[MATRIX : MATRIX + min(len(terms), TERMS)] = terms[:TERMS]
    if np.any(terms):
        width, height = camera.size
        x, y = np.array([-1.0, 0.5 * width, width]), np.array([-1.0, 0.5 * height, height])
        edge = np.array([(u, v) for u in x for v in y])[:, None]
        flat = cv2.undistortPoints(edge, camera.matrix, camera.distortions).reshape(-1, 2)
        lens[REACH] = float(np.max(np.sum(flat**2, axis=1)))
    return lens


@njit(cache=True, error_model="numpy", inline="always")
def shifted(lenses: Floats, j: int, x: float, y: float) -> tuple[float, float]:
    """(x, y) as the j-th lens bends it.  lenses: (v, LENGTH); a row cut out of it would cost more than the bending."""
    r2 = x * x + y * y
    above = 1.0 + r2 * (lenses[j, 5] + r2 * (lenses[j, 6] + r2 * lenses[j, 9]))
    bend = above / (1.0 + r2 * (lenses[j, 10] + r2 * (lenses[j, 11] + r2 * lenses[j, 12])))
    dx = 2.0 * lenses[j, 7] * x * y + lenses[j, 8] * (r2 + 2.0 * x * x) + r2 * (lenses[j, 13] + r2 * lenses[j, 14])
    dy = lenses[j, 7] * (r2 + 2.0 * y * y) + 2.0 * lenses[j, 8] * x * y + r2 * (lenses[j, 15] + r2 * lenses[j, 16])
    return x * bend + dx, y * bend + dy


@njit(cache=True, error_model="numpy")
def undistorted(lenses: Floats, j: int, u: float, v: float) -> tuple[float, float]:
    """(X / Z, Y / Z) of a pixel of the j-th lens."""
    y0 = (v - lenses[j, 4]) / lenses[j, 3]
    x0 = (u - lenses[j, 2] - lenses[j, 1] * y0) / lenses[j, 0]
    if lenses[j, REACH] == 0.0:
        return x0, y0
    x, y = x0, y0
    for _ in range(TURNS):
        bent_x, bent_y = shifted(lenses, j, x, y)
        x, y = x + x0 - bent_x, y + y0 - bent_y
        if abs(x0 - bent_x) + abs(y0 - bent_y) < EXACT:
            break
    return x, y
