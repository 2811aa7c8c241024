"""Cameras and silhouettes as arrays, and lens distortion in compiled loops.  [Hybrid III]"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Bytes, Floats, Ints
from zenocap.common.camera.pinhole import Camera
from zenocap.common.jit import inlined_kernel, kernel, leaf_kernel
from zenocap.services.tracker.parameters import UNDISTORTION_ITERATIONS, UNDISTORTION_TOLERANCE

MATRIX = 5  # fx, skew, cx, fy, cy
TERMS = 12  # k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4
REACH = MATRIX + TERMS  # square of the largest radius at which the lens holds; 0: no distortion
LENGTH = REACH + 1


def lens_parameters(camera: Camera) -> Floats:
    """(LENGTH,) parameters of a lens for `distort` and `undistort`, OpenCV's model.

    Beyond the image's corners a lens polynomial may fold back into it, so points beyond them are not in the image.
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


@inlined_kernel
def distort(lenses: Floats, j: int, x: float, y: float) -> tuple[float, float]:
    """Distort (x, y) = (X / Z, Y / Z) by the j-th lens.  lenses: (v, LENGTH); passing a single row would be slower."""
    r2 = x * x + y * y
    above = 1.0 + r2 * (lenses[j, 5] + r2 * (lenses[j, 6] + r2 * lenses[j, 9]))
    bend = above / (1.0 + r2 * (lenses[j, 10] + r2 * (lenses[j, 11] + r2 * lenses[j, 12])))
    dx = 2.0 * lenses[j, 7] * x * y + lenses[j, 8] * (r2 + 2.0 * x * x) + r2 * (lenses[j, 13] + r2 * lenses[j, 14])
    dy = lenses[j, 7] * (r2 + 2.0 * y * y) + 2.0 * lenses[j, 8] * x * y + r2 * (lenses[j, 15] + r2 * lenses[j, 16])
    return x * bend + dx, y * bend + dy


@leaf_kernel
def undistort(lenses: Floats, j: int, u: float, v: float) -> tuple[float, float]:
    """(X / Z, Y / Z) of a pixel of the j-th lens, by fixed-point iteration."""
    y0 = (v - lenses[j, 4]) / lenses[j, 3]
    x0 = (u - lenses[j, 2] - lenses[j, 1] * y0) / lenses[j, 0]
    if lenses[j, REACH] == 0.0:
        return x0, y0
    x, y = x0, y0
    for _ in range(UNDISTORTION_ITERATIONS):
        bent_x, bent_y = distort(lenses, j, x, y)
        x, y = x + x0 - bent_x, y + y0 - bent_y
        if abs(x0 - bent_x) + abs(y0 - bent_y) < UNDISTORTION_TOLERANCE:
            break
    return x, y


class Silhouettes(NamedTuple):
    """Silhouettes and cameras of v views.

    lens: (v, LENGTH).  rotation: (v, 3, 3) world to camera.  centre: (v, 3) metres.  size: (v, 2) width, height px.
    box: (v, 4) left, top, width, height of the cropped mask, px; width 0 where the view is absent.
    at: (v,) start of its first pixel in `pixels`.  pixels: (n,) all crops row by row, dilated by one pixel.
    bounds: (v, 4) least and greatest column and row of the mask, in px of the crop; with a lens, X / Z and Y / Z.
    whole: (v,) True when the silhouette does not touch the image's border, so that `bounds` limit the person.
    """

    lens: Floats
    rotation: Floats
    centre: Floats
    size: Ints
    box: Ints
    at: Ints
    pixels: Bytes
    bounds: Floats
    whole: Bools


def lenses_and_bounds(cameras: Sequence[Camera], boxes: Ints) -> tuple[Floats, Ints, Floats, Bools]:
    """`lens`, `size`, `bounds` and `whole` of Silhouettes with these boxes.  Raises as `lens_parameters`."""
    lens = np.array([lens_parameters(camera) for camera in cameras]).reshape(-1, LENGTH)
    sizes = np.array([camera.size for camera in cameras], dtype=np.int64).reshape(-1, 2)
    bounds, whole = np.zeros((len(cameras), 4)), np.zeros(len(cameras), dtype=np.bool_)
    _fill_bounds(lens, boxes, sizes, bounds, whole)
    return lens, sizes, bounds, whole


@kernel
def _fill_bounds(lens: Floats, box: Ints, size: Ints, bounds: Floats, whole: Bools) -> None:
    """Fill `bounds` and `whole` of Silhouettes."""
    for j in range(len(lens)):
        left, top, across, down = box[j, 0], box[j, 1], box[j, 2], box[j, 3]
        if across == 0:
            continue
        whole[j] = left > 0 and top > 0 and left + across < size[j, 0] and top + down < size[j, 1]
        if lens[j, REACH] == 0.0:
            bounds[j] = np.array([0.0, across, 0.0, down])
            continue
        bounds[j] = np.array([np.inf, -np.inf, np.inf, -np.inf])
        for side in range(4):
            for k in range(8):  # the extreme of a curved edge may be between its ends
                share = k / 8
                u = (share, 1.0, 1.0 - share, 0.0)[side] * (across - 1) + left
                v = (0.0, share, 1.0, 1.0 - share)[side] * (down - 1) + top
                x, y = undistort(lens, j, u, v)
                bounds[j, 0], bounds[j, 1] = min(bounds[j, 0], x), max(bounds[j, 1], x)
                bounds[j, 2], bounds[j, 3] = min(bounds[j, 2], y), max(bounds[j, 3], y)
