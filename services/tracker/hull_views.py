"""Silhouettes and their cameras as arrays, and contour points as lines in the world.  [Hybrid III]"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from services.tracker.lens import REACH, undistorted

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Flags = NDArray[np.bool_]


class Silhouettes(NamedTuple):
    """What the walk needs of v views, in arrays.

    lens: (v, lens.LENGTH).  rotation: (v, 3, 3) world to camera.  centre: (v, 3) metres.  size: (v, 2) width, height px.
    box: (v, 4) left, top, width, height of the cut-out mask, px; 0 wide where the view is absent.
    at: (v,) where its first pixel is in `pixels`.  pixels: (n,) all cut-outs row by row, dilated by one pixel.
    bounds: (v, 4) least and greatest column and row of the mask, in px of the cut-out; with a lens, X / Z and Y / Z.
    whole: (v,) whether the silhouette is clear of its image's border, so that `bounds` bind.
    """

    lens: Floats
    rotation: Floats
    centre: Floats
    size: Integers
    box: Integers
    at: Integers
    pixels: Bytes
    bounds: Floats
    whole: Flags


@njit(cache=True, error_model="numpy")
def bounds_of(lens: Floats, box: Integers, size: Integers, bounds: Floats, whole: Flags) -> None:
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
            for k in range(8):  # a bent edge reaches furthest somewhere between its ends
                share = k / 8
                u = (share, 1.0, 1.0 - share, 0.0)[side] * (across - 1) + left
                v = (0.0, share, 1.0, 1.0 - share)[side] * (down - 1) + top
                x, y = undistorted(lens, j, u, v)
                bounds[j, 0], bounds[j, 1] = min(bounds[j, 0], x), max(bounds[j, 1], x)
                bounds[j, 2], bounds[j, 3] = min(bounds[j, 2], y), max(bounds[j, 3], y)


@njit(cache=True, error_model="numpy")
def viewing_lines(view: Integers, points: Floats, tangents: Floats, seen: Silhouettes) -> tuple[Floats, Floats]:
    """Unit directions (n, 3) and unit normals (n, 3) in the world, of contour points and tangents (n, 2) px.

    The normal is viewing line x tangent, out of the person.
    """
    directions, normals = np.empty((len(view), 3)), np.empty((len(view), 3))
    for i in range(len(view)):
        j = view[i]
        length = np.hypot(tangents[i, 0], tangents[i, 1])
        du, dv = tangents[i, 0] / length, tangents[i, 1] / length
        x, y = undistorted(seen.lens, j, points[i, 0], points[i, 1])
        ahead_x, ahead_y = undistorted(seen.lens, j, points[i, 0] + du, points[i, 1] + dv)
        tx, ty = ahead_x - x, ahead_y - y
        nx, ny, nz = -ty, tx, x * ty - y * tx
        forward, outward = 1.0 / np.sqrt(x * x + y * y + 1.0), 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
        for k in range(3):
            directions[i, k] = forward * (seen.rotation[j, 0, k] * x + seen.rotation[j, 1, k] * y + seen.rotation[j, 2, k])
            normals[i, k] = outward * (
                seen.rotation[j, 0, k] * nx + seen.rotation[j, 1, k] * ny + seen.rotation[j, 2, k] * nz
            )
    return directions, normals


@njit(cache=True, error_model="numpy")
def frames_of(seen: Silhouettes) -> tuple[Floats, Floats]:
    """turn: (v, 3, 3) world directions to a view's X, Y, Z.  start: (v, v, 3) where view k has the centre of view i.

    Where there is no lens X and Y are in pixels of the cut-out times Z, half a pixel on so that cutting off rounds.
    """
    views = len(seen.lens)
    turn, start = np.empty((views, 3, 3)), np.zeros((views, views, 3))
    for j in range(views):
        lens = seen.lens[j]
        for b in range(3):
            x, y, z = seen.rotation[j, 0, b], seen.rotation[j, 1, b], seen.rotation[j, 2, b]
            turn[j, 0, b], turn[j, 1, b], turn[j, 2, b] = x, y, z
            if lens[REACH] == 0.0:
                turn[j, 0, b] = lens[0] * x + lens[1] * y + (lens[2] + 0.5 - seen.box[j, 0]) * z
                turn[j, 1, b] = lens[3] * y + (lens[4] + 0.5 - seen.box[j, 1]) * z
        for own in range(views):
            for a in range(3):
                for b in range(3):
                    start[own, j, a] += turn[j, a, b] * (seen.centre[own, b] - seen.centre[j, b])
    return turn, start
