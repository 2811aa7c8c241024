"""The projected body model as a cover image, and the matching score.  [Two-view 2.3, 3.2-3.5]

The cover image counts the body parts over each pixel.  A match moves one limb: its pixels are removed from the cover and
added elsewhere, and two totals change by the pixels that become covered or uncovered.  A match therefore costs the pixels
of the limb and not those of the image.  The compiled functions work in place.

totals: (3,) int64, pixels of the silhouette, of the model image, and of their intersection.
"""

from typing import cast

import numpy as np

from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.jit import kernel, leaf_kernel

CORNERS = 10  # of the outline of a part
NEAREST = 0.1  # m, smallest depth at which a part is drawn; chosen by hand
SINES = np.sin(np.pi / 4 * np.arange(-2, 5))  # entry k: sine of k - 2 eighths of a turn
# numpy integers: numba compiles a function once more for every Python integer constant that it is called with.
ADD, REMOVE, COUNT = cast(int, np.int64(1)), cast(int, np.int64(-1)), cast(int, np.int64(0))


@kernel
def score_of_counts(silhouette: int, model: int, both: int) -> float:
    """Matching score S in [0, 1]: exp(-p - n) (1 - p); 1 when both images are empty.  [Two-view Eq. 1]

    Pixel counts of the silhouette, of the model image, and of their intersection.
    """
    union = silhouette + model - both
    if union == 0:
        return 1.0
    p = (silhouette - both) / union
    n = (model - both) / union
    return float(np.exp(-p - n) * (1.0 - p))


@kernel
def part_outline(frame: Floats, size: Floats, camera: Floats, corners: Floats) -> bool:
    """Write the outline of an elliptic cylinder in the image, corners (CORNERS, 2) px in order; False if not visible.

    frame: (3, 4) part to world.  size: (3,) height, long and short radius, metres.
    camera: (5, 3) level camera: rotation rows, translation, (focal length, centre x, centre y).
    Each end is an ellipse under local parallel projection; the outline is the hull of the support points of both ends.
    Not visible: an end is less than NEAREST in front of the camera.
    """
    ends = np.empty((2, 6))  # per end: centre, two half axes
    focal = camera[4, 0]
    for end in range(2):
        x = frame[0, 3] + end * size[0] * frame[0, 1]
        y = frame[1, 3] + end * size[0] * frame[1, 1]
        z = frame[2, 3] + end * size[0] * frame[2, 1]
        depth = camera[2, 0] * x + camera[2, 1] * y + camera[2, 2] * z + camera[3, 2]
        if depth < NEAREST:
            return False
        u = (camera[0, 0] * x + camera[0, 1] * y + camera[0, 2] * z + camera[3, 0]) / depth
        v = (camera[1, 0] * x + camera[1, 1] * y + camera[1, 2] * z + camera[3, 1]) / depth
        ends[end, 0] = focal * u + camera[4, 1]
        ends[end, 1] = focal * v + camera[4, 2]
        for axis in range(2):
            scale = focal / depth * size[1 + axis]
            column = 2 * axis  # x, then z of the part
            a, b, c = frame[0, column], frame[1, column], frame[2, column]
            forward = camera[2, 0] * a + camera[2, 1] * b + camera[2, 2] * c
            ends[end, 2 + 2 * axis] = scale * (camera[0, 0] * a + camera[0, 1] * b + camera[0, 2] * c - u * forward)
            ends[end, 3 + 2 * axis] = scale * (camera[1, 0] * a + camera[1, 1] * b + camera[1, 2] * c - v * forward)
    dx, dy = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1]
    length = np.hypot(dx, dy)
    if length < 1e-6:
        dx, dy = 0.0, 1.0
    else:
        dx, dy = dx / length, dy / length
    at = 0
    for end in range(2):
        away = 1.0 if end == 1 else -1.0
        for step in range(5):  # half a turn around the first end, then around the second
            along, side = SINES[step + 2] * away, SINES[step] * away
            nx, ny = along * dx - side * dy, along * dy + side * dx
            a = ends[end, 2] * nx + ends[end, 3] * ny
            b = ends[end, 4] * nx + ends[end, 5] * ny
            reach = np.hypot(a, b)
            if reach < 1e-9:
                reach = 1e-9
            corners[at, 0] = ends[end, 0] + (ends[end, 2] * a + ends[end, 4] * b) / reach
            corners[at, 1] = ends[end, 1] + (ends[end, 3] * a + ends[end, 5] * b) / reach
            at += 1
    return True


@kernel
def cover_outline(corners: Floats, mask: Mask, cover: Mask, mode: int, totals: Ints) -> None:
    """Add a convex outline to the cover (ADD), remove it (REMOVE), or count the change of an addition (COUNT).

    corners: (n, 2) px, in order, clockwise or not.  mask, cover: (height, width).  A pixel is inside when its centre is.
    totals[1] and totals[2] change by the pixels that become covered or uncovered.
    """
    height, width = mask.shape
    low, high = corners[0, 1], corners[0, 1]
    for k in range(1, corners.shape[0]):
        low, high = min(low, corners[k, 1]), max(high, corners[k, 1])
    top, bottom = max(int(np.ceil(low)), 0), min(int(np.floor(high)), height - 1)
    if bottom < top or not np.isfinite(high - low):
        return
    spans = np.empty((bottom - top + 1, 2))
    spans[:, 0], spans[:, 1] = np.inf, -np.inf
    _row_spans(corners, top, bottom, spans)
    model, both = np.int64(0), np.int64(0)
    for y in range(top, bottom + 1):
        first = max(int(np.ceil(max(spans[y - top, 0], -1.0))), 0)
        last = min(int(np.floor(min(spans[y - top, 1], width * 1.0))), width - 1)
        if mode == COUNT:
            for x in range(first, last + 1):
                bare = np.int64(cover[y, x] == 0)
                model += bare
                both += bare * mask[y, x]
        elif mode == ADD:
            for x in range(first, last + 1):
                bare = np.int64(cover[y, x] == 0)
                cover[y, x] += 1
                model += bare
                both += bare * mask[y, x]
        else:
            for x in range(first, last + 1):
                cover[y, x] -= 1
                bare = np.int64(cover[y, x] == 0)
                model -= bare
                both -= bare * mask[y, x]
    totals[1] += model
    totals[2] += both


@leaf_kernel
def _row_spans(corners: Floats, top: int, bottom: int, spans: Floats) -> None:
    """Extend spans (bottom - top + 1, 2), first and last x of each row, to those of a convex outline."""
    for k in range(corners.shape[0]):
        other = k + 1 if k + 1 < corners.shape[0] else 0
        x0, y0, x1, y1 = corners[k, 0], corners[k, 1], corners[other, 0], corners[other, 1]
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
        if y1 <= y0:
            continue
        slope = (x1 - x0) / (y1 - y0)
        for y in range(max(int(np.ceil(y0)), top), min(int(np.floor(y1)), bottom) + 1):
            x = x0 + (y - y0) * slope
            spans[y - top, 0] = min(spans[y - top, 0], x)
            spans[y - top, 1] = max(spans[y - top, 1], x)


@kernel
def cover_pair(frames: Floats, sizes: Floats, camera: Floats, mask: Mask, cover: Mask, mode: int, totals: Ints) -> None:
    """Add, remove or count two overlapping parts: frames (2, 3, 4), sizes (2, 3).  COUNT restores the cover."""
    first, second = np.empty((CORNERS, 2)), np.empty((CORNERS, 2))
    first_visible = part_outline(frames[0], sizes[0], camera, first)
    second_visible = part_outline(frames[1], sizes[1], camera, second)
    if mode != COUNT:
        if first_visible:
            cover_outline(first, mask, cover, mode, totals)
        if second_visible:
            cover_outline(second, mask, cover, mode, totals)
        return
    if first_visible:  # the second part counts only pixels that the first leaves uncovered
        cover_outline(first, mask, cover, ADD, totals)
    if second_visible:
        cover_outline(second, mask, cover, COUNT, totals)
    model, both = totals[1], totals[2]
    if first_visible:
        cover_outline(first, mask, cover, REMOVE, totals)
    totals[1], totals[2] = model, both
