"""Support of viewing lines by the other silhouettes, also with one view shifted in time."""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.common.jit import kernel
from zenocap.services.tracker.hull.contours import Contours
from zenocap.services.tracker.hull.ray_intersection import (
    INSIDE,
    OUTSIDE,
    inside_view,
    other_views,
    relative_frames,
    viewing_lines,
)
from zenocap.services.tracker.hull.views import MATRIX, REACH, Silhouettes
from zenocap.services.tracker.parameters import (
    MAX_DEPTH_M,
    MAX_LAG_FRAMES,
    MAX_RAY_STEPS,
    MIN_DEPTH_M,
    RAY_STEP_PX,
    VIEW_MARGIN,
)

SUPPORTED = -1


@kernel
def line_support(view: Ints, directions: Floats, silhouettes: Silhouettes) -> Ints:
    """Support of every viewing line (n,).

    SUPPORTED when all other views share some point on it.  Otherwise a sum of 2 ** j over the views j without which the
    others would, 0 when there is none.  view: (n,) origin of each line; it need not be among the silhouettes of the frame.
    """
    out = np.zeros(len(view), dtype=np.int64)
    views = len(silhouettes.lens)
    turn, start = relative_frames(silhouettes)
    line, order = np.empty((views, 9)), np.empty(views, dtype=np.int64)
    lens, box, size, at, pixels = silhouettes.lens, silhouettes.box, silhouettes.size, silhouettes.at, silhouettes.pixels
    bent = lens[:, REACH].copy()
    for i in range(len(view)):
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        rejecting = other_views(view[i], dx, dy, dz, turn, start, box, bent, line, order)
        first, last, step = _depth_range(line, order, rejecting, silhouettes)
        for n in range(int((last - first) / step) + 1 if last > first else 0):
            depth = first + n * step
            outside_of, inside_any = -1, False
            for k in range(rejecting):
                j = order[k]
                location = inside_view(depth, j, line, lens, box, size, at, pixels)
                if location == OUTSIDE and outside_of >= 0:
                    order[k] = order[0]
                    order[0] = j
                    outside_of = -2
                    break
                if location == OUTSIDE:
                    outside_of = j
                inside_any |= location == INSIDE
            if inside_any and outside_of == -1:
                out[i] = SUPPORTED
                break
            if inside_any and outside_of >= 0:
                out[i] |= 1 << outside_of
    return out


@kernel
def _depth_range(line: Floats, order: Ints, rejecting: int, silhouettes: Silhouettes) -> tuple[float, float, float]:
    """First and last depth within the boxes of all silhouettes but one, and a step of about a pixel."""
    first, second = MIN_DEPTH_M, MIN_DEPTH_M
    last, before = MAX_DEPTH_M, MAX_DEPTH_M
    finest = 0.0
    for k in range(rejecting):
        j = order[k]
        if not silhouettes.whole[j]:
            continue
        low, high = MIN_DEPTH_M, MAX_DEPTH_M
        for side in range(4):
            sign, axis = (1.0 if side % 2 == 0 else -1.0), side // 2
            constant = sign * (line[j, axis] - silhouettes.bounds[j, side] * line[j, 2])
            slope = sign * (line[j, axis + 3] - silhouettes.bounds[j, side] * line[j, 5])
            if slope > 0.0:
                low = max(low, -constant / slope)
            elif slope < 0.0:
                high = min(high, -constant / slope)
            elif constant < 0.0:
                low = MAX_DEPTH_M
        first, second = max(first, low), max(second, min(first, low))
        last, before = min(last, high), min(before, max(last, high))
    if second >= before:
        return 1.0, 0.0, 1.0
    middle = 0.5 * (second + before)
    for k in range(rejecting):
        j = order[k]
        z = max(line[j, 2] + middle * line[j, 5], MIN_DEPTH_M)
        px, py = line[j, 3] * line[j, 2] - line[j, 0] * line[j, 5], line[j, 4] * line[j, 2] - line[j, 1] * line[j, 5]
        if silhouettes.lens[j, REACH] > 0.0:
            px, py = silhouettes.lens[j, 0] * px, silhouettes.lens[j, 3] * py
        finest = max(finest, np.sqrt(px * px + py * py) / (z * z))
    return second, before, max(RAY_STEP_PX / max(finest, 1e-9), (before - second) / MAX_RAY_STEPS)


@kernel
def changed_fraction(before: Silhouettes, after: Silhouettes) -> Floats:
    """Changed fraction of each view's silhouette, (v,): pixels in one of both only, over those in `after`.

    NaN where one of them is empty.
    """
    share = np.full(len(after.box), np.nan)
    for j in range(len(after.box)):
        if before.box[j, 2] == 0 or after.box[j, 2] == 0:
            continue
        left, top = max(before.box[j, 0], after.box[j, 0]), max(before.box[j, 1], after.box[j, 1])
        right = min(before.box[j, 0] + before.box[j, 2], after.box[j, 0] + after.box[j, 2])
        bottom = min(before.box[j, 1] + before.box[j, 3], after.box[j, 1] + after.box[j, 3])
        both = 0
        for y in range(top, bottom):
            then = before.at[j] + (y - before.box[j, 1]) * before.box[j, 2] - before.box[j, 0]
            now = after.at[j] + (y - after.box[j, 1]) * after.box[j, 2] - after.box[j, 0]
            for x in range(left, right):
                both += (before.pixels[then + x] != 0) & (after.pixels[now + x] != 0)
        area = _area(after, j)
        share[j] = (_area(before, j) + area - 2 * both) / area
    return share


@kernel
def _area(silhouettes: Silhouettes, j: int) -> int:
    """Number of silhouette pixels of view j."""
    area = 0
    for k in range(silhouettes.at[j], silhouettes.at[j] + silhouettes.box[j, 2] * silhouettes.box[j, 3]):
        area += silhouettes.pixels[k] != 0
    return area


Outlines = tuple[Contours, Silhouettes]  # result of `extract_outlines`


class Lines(NamedTuple):
    """Viewing lines.  view: (n,) of each line.  directions: (n, 3) unit, in the world."""

    view: Ints
    directions: Floats


def sample_lines(moment: Outlines, each: int, check: int) -> Lines:
    """About `each` lines of every view, evenly along its contours; different ones at every check."""
    contours, silhouettes = moment
    counts = np.bincount(contours.view, minlength=len(silhouettes.lens))
    starts = np.cumsum(counts) - counts  # points are grouped by view
    picked = []
    for start, count in zip(starts.tolist(), counts.tolist(), strict=True):
        apart = max(1, count // each)
        picked.append(np.arange(start + check % apart, start + count, apart))
    index = np.concatenate(picked)
    directions, _ = viewing_lines(contours.view[index], contours.points[index], contours.tangents[index], silhouettes)
    return Lines(contours.view[index], directions)


def lagged_unsupported(recent: tuple[Outlines, ...], view: int, each: int, check: int) -> Floats:
    """Unsupported fraction of all lines for lags of -MAX_LAG_FRAMES to MAX_LAG_FRAMES of one view.

    Returns (2 * MAX_LAG_FRAMES + 1,).  The view's newest silhouette is paired with those of the other views `lag` frames
    earlier; a late view has its minimum at a positive lag.  recent: MAX_LAG_FRAMES + 1 frames, the newest last.
    NaN where a frame has no lines.
    """
    lines = [sample_lines(moment, each, check) for moment in recent]
    shares = np.full(2 * MAX_LAG_FRAMES + 1, np.nan)
    for k, lag in enumerate(range(-MAX_LAG_FRAMES, MAX_LAG_FRAMES + 1)):
        newest_of_view, others = MAX_LAG_FRAMES - max(-lag, 0), MAX_LAG_FRAMES - max(lag, 0)
        silhouettes = with_view_of(recent[others][1], recent[newest_of_view][1], view)
        other_lines, own = lines[others].view != view, lines[newest_of_view].view == view
        views = np.concatenate([lines[others].view[other_lines], lines[newest_of_view].view[own]])
        directions = np.concatenate([lines[others].directions[other_lines], lines[newest_of_view].directions[own]])
        if len(views) > 0:
            shares[k] = np.mean(line_support(views, directions, silhouettes) != SUPPORTED)
    return shares


def in_view(silhouettes: Silhouettes) -> Bools:
    """(v,) True where the person is well inside the image: the intersection of the lines through the silhouettes' centres.

    False with fewer than two silhouettes.
    """
    views = np.flatnonzero(silhouettes.box[:, 2])
    if len(views) < 2:
        return np.zeros(len(silhouettes.box), dtype=np.bool_)
    middles = silhouettes.box[views, :2] + 0.5 * silhouettes.box[views, 2:]
    directions, _ = viewing_lines(views, middles, np.tile([1.0, 0.0], (len(views), 1)), silhouettes)
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    where = np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, silhouettes.centre[views]), rcond=None)[0]
    local = np.einsum("vij,vj->vi", silhouettes.rotation, where - silhouettes.centre)
    fx, skew, cx, fy, cy = silhouettes.lens[:, :MATRIX].T
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
        u, v = (fx * x + skew * y + cx) / silhouettes.size[:, 0], (fy * y + cy) / silhouettes.size[:, 1]
        inside = (np.abs(u - 0.5) < 0.5 - VIEW_MARGIN) & (np.abs(v - 0.5) < 0.5 - VIEW_MARGIN)
    found: Bools = inside & (local[:, 2] > 0)
    return found


def with_view_of(silhouettes: Silhouettes, other: Silhouettes, view: int) -> Silhouettes:
    """`silhouettes`, with one view replaced by that in `other`."""
    if silhouettes is other:
        return silhouettes
    box, at = silhouettes.box.copy(), silhouettes.at.copy()
    bounds, whole = silhouettes.bounds.copy(), silhouettes.whole.copy()
    box[view], bounds[view], whole[view] = other.box[view], other.bounds[view], other.whole[view]
    at[view] = len(silhouettes.pixels)
    start = int(other.at[view])
    pixels = np.concatenate([silhouettes.pixels, other.pixels[start : start + int(box[view, 2] * box[view, 3])]])
    return silhouettes._replace(box=box, at=at, bounds=bounds, whole=whole, pixels=pixels)
