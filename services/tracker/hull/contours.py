"""Evenly spaced points along the contours of silhouettes, with smoothed tangents.  [Hybrid III]"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Ints, Ints32, Mask
from zenocap.common.jit import inlined_kernel, kernel
from zenocap.services.tracker.parameters import MIN_CONTOUR_PX, TANGENT_REACH_PX


class Contours(NamedTuple):
    """Contour points.

    view: (n,) index of the mask.  tangents: (n, 2) px, of arbitrary length; (-y, x) of them points outwards.
    points: (n, 2) px, centre of an outermost pixel of the silhouette: half a pixel inside the contour, always on the
    person.  edges: (n, 2) px, position of the contour: mean of three such centres, moved half a pixel outwards (measured on
    the simulated person: bias 0.07 px, deviation 0.25 px; the points themselves: -0.45 px, 0.30 px).
    """

    view: Ints
    points: Floats
    edges: Floats
    tangents: Floats


def sample_contours(views: Sequence[int], masks: Sequence[Mask], boxes: Ints, sizes: Ints, count: int) -> Contours:
    """Sample about `count` points in all, evenly along all contours, outer ones and holes.

    views: index of the view of each mask.  masks: (height, width) uint8 crops.  boxes: (v, 4) of all views, left and top
    first, px; a crop has a margin of a pixel except at the image's border.  sizes: (v, 2) width and height of the images.
    Along the image's border there is no contour of the person, and no point.
    """
    chains: list[Ints32] = []
    owners: list[int] = []
    ends: list[int] = []
    length = 0
    for view, mask in zip(views, masks, strict=True):
        found, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        for chain in found:
            if len(chain) >= MIN_CONTOUR_PX:
                length += len(chain)
                chains.append(np.asarray(chain, dtype=np.int32))
                owners.append(view)
                ends.append(length)
    if not chains or count < 1:
        return Contours(np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)))
    chain = np.concatenate(chains).reshape(-1, 2)
    return Contours(*_resample(chain, np.array(ends), np.array(owners), boxes, sizes, count))


@kernel
def _free_steps(chain: Ints32, ends: Ints, owners: Ints, boxes: Ints, sizes: Ints) -> tuple[Floats32, float]:
    """Half the way (m,) from the point before to the point after each, 0 along the image's border; and their sum.

    Arguments as of `_resample`.
    """
    steps = np.empty(len(chain), dtype=np.float32)
    total, start = 0.0, 0
    for c in range(len(ends)):
        end, view = ends[c], owners[c]
        left, top = boxes[view, 0], boxes[view, 1]
        before = _step_length(chain, end - 1, start)
        for i in range(start, end):
            after = _step_length(chain, i, i + 1 if i + 1 < end else start)
            steps[i] = np.float32(0.5) * (before + after)
            before = after
        for i in range(start, end):
            x, y = chain[i, 0] + left, chain[i, 1] + top
            if x <= 0 or y <= 0 or x >= sizes[view, 0] - 1 or y >= sizes[view, 1] - 1:
                for k in range(-TANGENT_REACH_PX, TANGENT_REACH_PX + 1):
                    steps[_wrapped(i + k, start, end)] = 0.0
        for i in range(start, end):
            total += steps[i]
        start = end
    return steps, total


@kernel
def _resample(
    chain: Ints32, ends: Ints, owners: Ints, boxes: Ints, sizes: Ints, count: int
) -> tuple[Ints, Floats, Floats, Floats]:
    """Resample contours at equal distances.

    chain: (m, 2) closed contours one after another, in their crops.  ends, owners: (c,) end and view of each contour.
    """
    steps, total = _free_steps(chain, ends, owners, boxes, sizes)
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
            for k in range(1, TANGENT_REACH_PX + 1):
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


@inlined_kernel
def _wrapped(i: int, start: int, end: int) -> int:
    if i < start:
        return i + end - start
    return i - end + start if i >= end else i


@inlined_kernel
def _step_length(chain: Ints32, a: int, b: int) -> float:
    """Length of the step from one pixel of a contour to the next."""
    return 1.0 if chain[a, 0] == chain[b, 0] or chain[a, 1] == chain[b, 1] else 1.4142135623730951
