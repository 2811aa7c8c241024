"""Viewing lines cut with the silhouettes of the other views: where on each line the visual hull survives.  [Hybrid III]"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from services.tracker.lens import REACH, shifted, undistorted

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Flags = NDArray[np.bool_]

NEAREST_M, FURTHEST_M = 0.1, 50.0
MOST_STEPS = 4000
HALVINGS = 3  # of a step, where an interval begins and ends


class Silhouettes(NamedTuple):
    """What the walk needs of v views, in arrays.

    lens: (v, lens.LENGTH).  rotation: (v, 3, 3) world to camera.  centre: (v, 3) metres.  size: (v, 2) width, height px.
    box: (v, 4) left, top, width, height of the cut-out mask, px; 0 wide where the view is absent.
    at: (v,) where its first pixel is in `pixels`.  pixels: (n,) all cut-outs row by row, dilated by one pixel.
    bounds: (v, 4) least x, greatest x, least y, greatest y of X / Z and Y / Z that the mask allows.
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
def viewing_lines(view: Integers, points: Floats, tangents: Floats, seen: Silhouettes) -> tuple[Floats, Floats]:
    """Unit directions (n, 3) and unit normals (n, 3) in the world, of contour points and tangents (n, 2) px.

    The normal is viewing line x tangent, out of the person.
    """
    directions, normals = np.empty((len(view), 3)), np.empty((len(view), 3))
    for i in range(len(view)):
        lens, rotation = seen.lens[view[i]], seen.rotation[view[i]]
        length = np.hypot(tangents[i, 0], tangents[i, 1])
        du, dv = tangents[i, 0] / length, tangents[i, 1] / length
        x, y = undistorted(lens, points[i, 0], points[i, 1])
        ahead_x, ahead_y = undistorted(lens, points[i, 0] + du, points[i, 1] + dv)
        tx, ty = ahead_x - x, ahead_y - y
        nx, ny, nz = -ty, tx, x * ty - y * tx
        forward, outward = 1.0 / np.sqrt(x * x + y * y + 1.0), 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
        for k in range(3):
            directions[i, k] = forward * (rotation[0, k] * x + rotation[1, k] * y + rotation[2, k])
            normals[i, k] = outward * (rotation[0, k] * nx + rotation[1, k] * ny + rotation[2, k] * nz)
    return directions, normals


@njit(cache=True, error_model="numpy")
def survive(view: Integers, directions: Floats, seen: Silhouettes, near: Floats, far: Floats) -> None:
    """near, far (n,): metres along each viewing line between which the hull survives; near > far where it does not.

    A place survives when every view that has it in its image has it in its silhouette, and one view at least does.
    Of several intervals the longest is given.
    """
    views = len(seen.lens)
    # A view's coordinates at depth d are start + d * along.
    start, along = np.empty((views, 3)), np.empty((views, 3))
    for i in range(len(view)):
        near[i], far[i] = 1.0, 0.0
        own = view[i]
        for j in range(views):
            for a in range(3):
                start[j, a], along[j, a] = 0.0, 0.0
                for b in range(3):
                    start[j, a] += seen.rotation[j, a, b] * (seen.centre[own, b] - seen.centre[j, b])
                    along[j, a] += seen.rotation[j, a, b] * directions[i, b]
        first, last = _reach(own, start, along, seen)
        if first >= last:
            continue
        step = _pixel(own, start, along, seen, first, last)
        began, inside, best = 0.0, False, 0.0
        steps = int(np.ceil((last - first) / step)) + 1
        for k in range(steps + 1):
            depth = first + k * step
            survives = k < steps and _inside(own, start, along, seen, depth)
            if survives and not inside:
                began = _edge(own, start, along, seen, depth, depth - step) if k > 0 else depth
                inside = True
            elif inside and not survives:
                ended = _edge(own, start, along, seen, depth - step, depth)
                inside = False
                if ended - began >= best:
                    near[i], far[i], best = began, ended, ended - began


@njit(cache=True, error_model="numpy")
def _reach(own: int, start: Floats, along: Floats, seen: Silhouettes) -> tuple[float, float]:
    """Between which depths the silhouettes' boxes let a viewing line live."""
    first, last = NEAREST_M, FURTHEST_M
    judged = False
    for j in range(len(start)):
        if j == own or seen.box[j, 2] == 0:
            continue
        judged = True
        if not seen.whole[j]:
            continue
        for side in range(4):
            # x / z >= least is x - least * z >= 0, linear in the depth, as z > 0.
            sign, axis, bound = (1.0 if side % 2 == 0 else -1.0), side // 2, seen.bounds[j, side]
            constant = sign * (start[j, axis] - bound * start[j, 2])
            slope = sign * (along[j, axis] - bound * along[j, 2])
            if slope > 0.0:
                first = max(first, -constant / slope)
            elif slope < 0.0:
                last = min(last, -constant / slope)
            elif constant < 0.0:
                return 1.0, 0.0
        if along[j, 2] > 0.0:
            first = max(first, (NEAREST_M - start[j, 2]) / along[j, 2])
        elif along[j, 2] < 0.0:
            last = min(last, (NEAREST_M - start[j, 2]) / along[j, 2])
    return (first, last) if judged else (1.0, 0.0)


@njit(cache=True, error_model="numpy")
def _pixel(own: int, start: Floats, along: Floats, seen: Silhouettes, first: float, last: float) -> float:
    """The depth that moves one pixel in the view where the line is longest, metres."""
    longest = 1.0
    for j in range(len(start)):
        if j == own or seen.box[j, 2] == 0:
            continue
        z0, z1 = start[j, 2] + first * along[j, 2], start[j, 2] + last * along[j, 2]
        if z0 < NEAREST_M or z1 < NEAREST_M:
            continue
        dx = (start[j, 0] + last * along[j, 0]) / z1 - (start[j, 0] + first * along[j, 0]) / z0
        dy = (start[j, 1] + last * along[j, 1]) / z1 - (start[j, 1] + first * along[j, 1]) / z0
        longest = max(longest, np.hypot(seen.lens[j, 0] * dx, seen.lens[j, 3] * dy))
    return (last - first) / min(longest, float(MOST_STEPS))


@njit(cache=True, error_model="numpy", inline="always")
def _inside(own: int, start: Floats, along: Floats, seen: Silhouettes, depth: float) -> bool:
    """Whether the place at a depth survives."""
    judged = False
    for j in range(len(start)):
        if j == own or seen.box[j, 2] == 0:
            continue
        z = start[j, 2] + depth * along[j, 2]
        if z < NEAREST_M:
            continue
        x, y = (start[j, 0] + depth * along[j, 0]) / z, (start[j, 1] + depth * along[j, 1]) / z
        lens = seen.lens[j]
        if lens[REACH] > 0.0:
            if x * x + y * y > lens[REACH]:
                continue
            x, y = shifted(lens, x, y)
        u = int(np.floor(lens[0] * x + lens[1] * y + lens[2] + 0.5))
        v = int(np.floor(lens[3] * y + lens[4] + 0.5))
        if u < 0 or v < 0 or u >= seen.size[j, 0] or v >= seen.size[j, 1]:
            continue
        u -= seen.box[j, 0]
        v -= seen.box[j, 1]
        if u < 0 or v < 0 or u >= seen.box[j, 2] or v >= seen.box[j, 3]:
            return False
        if seen.pixels[seen.at[j] + v * seen.box[j, 2] + u] == 0:
            return False
        judged = True
    return judged


@njit(cache=True, error_model="numpy")
def _edge(own: int, start: Floats, along: Floats, seen: Silhouettes, inside: float, outside: float) -> float:
    """The surviving depth next to where survival ends, between one that survives and one that does not."""
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if _inside(own, start, along, seen, middle):
            inside = middle
        else:
            outside = middle
    return inside
