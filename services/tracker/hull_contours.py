"""Points evenly along the contours of silhouettes, with tangents of a smoothed stretch.  [Hybrid III]"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.vision.background import Mask

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Chain = NDArray[np.int32]

REACH = 4  # px either way along the contour from which a point's tangent is taken
LEAST = 4 * REACH  # px of a contour; what is shorter has no tangent to speak of


class Contours(NamedTuple):
    """view: (n,) which mask.  tangents: (n, 2) px, of no set length; outwards is (-y, x) of them.

    points: (n, 2) px, the middle of an outermost pixel of the silhouette: half a pixel inside the contour, surely on the
    person.  edges: (n, 2) px, where the contour is: the mean of three such, half a pixel outwards (measured on the actor:
    off by 0.07 px with a spread of 0.25 px, the points themselves by -0.45 px and 0.30 px).
    """

    view: Integers
    points: Floats
    edges: Floats
    tangents: Floats


def sample_contours(views: Sequence[int], masks: Sequence[Mask], boxes: Integers, sizes: Integers, count: int) -> Contours:
    """About `count` points in all, evenly along all contours, outer ones and holes.

    views: whose each mask is.  masks: (height, width) uint8 cut-outs.  boxes: (v, 4) of all views, left and top first, px;
    a pixel is free around the person but at the image's border.  sizes: (v, 2) width and height of the images.
    Where a silhouette is cut by its image's border there is no contour of the person, and no point.
    """
    chains: list[Chain] = []
    owners: list[int] = []
    ends: list[int] = []
    length = 0
    for view, mask in zip(views, masks, strict=True):
        found, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for chain in found:
            if len(chain) >= LEAST:
                length += len(chain)
                chains.append(np.asarray(chain, dtype=np.int32))
                owners.append(view)
                ends.append(length)
    if not chains or count < 1:
        return Contours(np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)))
    chain = np.concatenate(chains).reshape(-1, 2)
    return Contours(*_along(chain, np.array(ends), np.array(owners), boxes, sizes, count))


@njit(cache=True, error_model="numpy")
def _along(
    chain: Chain, ends: Integers, owners: Integers, boxes: Integers, sizes: Integers, count: int
) -> tuple[Integers, Floats, Floats, Floats]:
    """chain: (m, 2) closed contours behind one another, in their cut-outs.  ends, owners: (c,) of each contour."""
    steps = np.empty(len(chain), dtype=np.float32)  # half the way from the point before to the point after; 0: not free
    total, start = 0.0, 0
    for c in range(len(ends)):
        end, view = ends[c], owners[c]
        left, top = boxes[view, 0], boxes[view, 1]
        before = _way(chain, end - 1, start)
        for i in range(start, end):
            after = _way(chain, i, i + 1 if i + 1 < end else start)
            steps[i] = np.float32(0.5) * (before + after)
            before = after
        for i in range(start, end):
            x, y = chain[i, 0] + left, chain[i, 1] + top
            if x <= 0 or y <= 0 or x >= sizes[view, 0] - 1 or y >= sizes[view, 1] - 1:
                for k in range(-REACH, REACH + 1):
                    steps[_wrapped(i + k, start, end)] = 0.0
        for i in range(start, end):
            total += steps[i]
        start = end
    view_of, made = np.empty(count, dtype=np.int64), 0
    points, edges, tangents = np.empty((count, 2)), np.empty((count, 2)), np.empty((count, 2))
    spacing, start = total / count, 0
    passed = -0.5 * spacing
    for c in range(len(ends)):
        end, view = ends[c], owners[c]
        for i in range(start, end):
            passed += steps[i]
            if steps[i] == 0.0 or passed < 0.0 or made == count:
                continue
            passed -= spacing
            tx, ty = 0, 0
            for k in range(1, REACH + 1):
                ahead, behind = _wrapped(i + k, start, end), _wrapped(i - k, start, end)
                tx += k * (chain[ahead, 0] - chain[behind, 0])
                ty += k * (chain[ahead, 1] - chain[behind, 1])
            if tx == 0 and ty == 0:
                continue
            view_of[made] = view
            points[made, 0], points[made, 1] = chain[i, 0] + boxes[view, 0], chain[i, 1] + boxes[view, 1]
            ahead, behind = _wrapped(i + 1, start, end), _wrapped(i - 1, start, end)
            # Outermost pixels lie up to a step along the nearer axis inside the contour; their mean, half of that.
            out = 0.5 * max(abs(tx), abs(ty)) / (tx * tx + ty * ty)
            for axis in range(2):
                middle = (chain[behind, axis] + chain[i, axis] + chain[ahead, axis]) / 3.0
                edges[made, axis] = middle + boxes[view, axis] + out * (-ty if axis == 0 else tx)
            tangents[made, 0], tangents[made, 1] = tx, ty
            made += 1
        start = end
    return view_of[:made], points[:made], edges[:made], tangents[:made]


@njit(cache=True, error_model="numpy", inline="always")
def _wrapped(i: int, start: int, end: int) -> int:
    if i < start:
        return i + end - start
    return i - end + start if i >= end else i


@njit(cache=True, error_model="numpy", inline="always")
def _way(chain: Chain, a: int, b: int) -> float:
    """From one pixel of a contour to the next."""
    return 1.0 if chain[a, 0] == chain[b, 0] or chain[a, 1] == chain[b, 1] else 1.4142135623730951
