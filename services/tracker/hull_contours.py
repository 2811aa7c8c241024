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
    """view: (n,) which mask.  points: (n, 2) px.  tangents: (n, 2) px, of no set length; outwards is (-y, x) of them.

    A point is the middle of a silhouette's outermost pixels: half a pixel inside the contour.
    """

    view: Integers
    points: Floats
    tangents: Floats


def sample_contours(
    views: Sequence[int],
    masks: Sequence[Mask],
    places: Sequence[tuple[int, int]],
    sizes: Sequence[tuple[int, int]],
    count: int,
) -> Contours:
    """About `count` points in all, evenly along all contours, outer ones and holes.

    views: what to call each mask.  masks: (height, width) uint8 cut-outs with a free edge of a pixel around the person.
    places: left and top of the cut-outs in their images, px.  sizes: (width, height) of the images.
    Where a silhouette is cut by its image's border there is no contour of the person, and no point.
    """
    chains: list[Chain] = []
    owners: list[tuple[int, int, int]] = []
    for view, mask, (left, top), size in zip(views, masks, places, sizes, strict=True):
        found, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE, offset=(left, top))
        for chain in found:
            if len(chain) >= LEAST:
                chains.append(np.asarray(chain, dtype=np.int32).reshape(-1, 2))
                owners.append((view, *size))
    if not chains or count < 1:
        return Contours(np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)))
    ends = np.cumsum([len(chain) for chain in chains])
    return Contours(*_along(np.concatenate(chains), ends, np.array(owners, dtype=np.int64), count))


@njit(cache=True, error_model="numpy")
def _along(chain: Chain, ends: Integers, owners: Integers, count: int) -> tuple[Integers, Floats, Floats]:
    """chain: (m, 2) closed contours behind one another.  ends: (c,) theirs.  owners: (c, 3) view, width, height."""
    free = np.empty(len(chain), dtype=np.bool_)
    total = 0.0
    start = 0
    for c in range(len(ends)):
        length = ends[c] - start
        last_x, last_y = owners[c, 1] - 1, owners[c, 2] - 1
        for i in range(length):
            free[start + i] = True
        for i in range(length):
            x, y = chain[start + i, 0], chain[start + i, 1]
            if x <= 0 or y <= 0 or x >= last_x or y >= last_y:
                for k in range(-REACH, REACH + 1):
                    free[start + (i + k) % length] = False
        for i in range(length):
            if free[start + i]:
                total += _step(chain, start, length, i)
        start = ends[c]
    view = np.empty(count, dtype=np.int64)
    points = np.empty((count, 2))
    tangents = np.empty((count, 2))
    spacing = total / count
    made, passed, start = 0, -0.5 * spacing, 0
    for c in range(len(ends)):
        length = ends[c] - start
        for i in range(length):
            if not free[start + i]:
                continue
            passed += _step(chain, start, length, i)
            if passed < 0.0 or made == count:
                continue
            passed -= spacing
            tx, ty, px, py = 0.0, 0.0, 0.0, 0.0
            for k in range(1, REACH + 1):
                ahead, behind = start + (i + k) % length, start + (i - k) % length
                tx += k * (chain[ahead, 0] - chain[behind, 0])
                ty += k * (chain[ahead, 1] - chain[behind, 1])
            px, py = float(chain[start + i, 0]), float(chain[start + i, 1])
            if tx == 0.0 and ty == 0.0:
                continue
            view[made] = owners[c, 0]
            points[made, 0], points[made, 1] = px, py
            tangents[made, 0], tangents[made, 1] = tx, ty
            made += 1
        start = ends[c]
    return view[:made], points[:made], tangents[:made]


@njit(cache=True, error_model="numpy")
def _step(chain: Chain, start: int, length: int, i: int) -> float:
    """Half the way from the contour's point before the i-th to that after it, px."""
    a, b, c = start + (i - 1) % length, start + i, start + (i + 1) % length
    before = np.hypot(float(chain[b, 0] - chain[a, 0]), float(chain[b, 1] - chain[a, 1]))
    after = np.hypot(float(chain[c, 0] - chain[b, 0]), float(chain[c, 1] - chain[b, 1]))
    return float(0.5 * (before + after))
