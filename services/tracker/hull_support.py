"""Which viewing lines the other silhouettes support, and of those they do not, which single view is in the way."""

import numpy as np
from numba import njit

from services.tracker.hull_rays import FURTHEST_M, MOST_STEPS, NEAREST_M, NO, STRIDE, YES, judges_of, verdict
from services.tracker.hull_views import Floats, Integers, Silhouettes, frames_of
from services.tracker.lens import REACH

SUPPORTED = -1


@njit(cache=True, error_model="numpy")
def support(view: Integers, directions: Floats, seen: Silhouettes) -> Integers:
    """For every viewing line (n,): SUPPORTED when all other views let some place on it survive; otherwise a sum of
    2 ** j over the views j without which the others would, 0 when there is no such view.

    view: whose the line is; it need not be among the silhouettes of the same moment.
    """
    out = np.zeros(len(view), dtype=np.int64)
    views = len(seen.lens)
    turn, start = frames_of(seen)
    line, order = np.empty((views, 9)), np.empty(views, dtype=np.int64)
    lens, box, size, at, pixels = seen.lens, seen.box, seen.size, seen.at, seen.pixels
    bent = lens[:, REACH].copy()
    for i in range(len(view)):
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        judges = judges_of(view[i], dx, dy, dz, turn, start, box, bent, line, order)
        first, last, step = _range(line, order, judges, seen)
        for n in range(int((last - first) / step) + 1 if last > first else 0):
            depth = first + n * step
            against, agreed = -1, False
            for k in range(judges):
                j = order[k]
                said = verdict(depth, j, line, lens, box, size, at, pixels)
                if said == NO and against >= 0:
                    order[k] = order[0]
                    order[0] = j
                    against = -2
                    break
                if said == NO:
                    against = j
                agreed |= said == YES
            if agreed and against == -1:
                out[i] = SUPPORTED
                break
            if agreed and against >= 0:
                out[i] |= 1 << against
    return out


@njit(cache=True, error_model="numpy")
def _range(line: Floats, order: Integers, judges: int, seen: Silhouettes) -> tuple[float, float, float]:
    """Between which depths all silhouettes' boxes but one's let a viewing line live, and a step of about a pixel."""
    first, second = NEAREST_M, NEAREST_M
    last, before = FURTHEST_M, FURTHEST_M
    finest = 0.0
    for k in range(judges):
        j = order[k]
        if not seen.whole[j]:
            continue
        low, high = NEAREST_M, FURTHEST_M
        for side in range(4):
            sign, axis = (1.0 if side % 2 == 0 else -1.0), side // 2
            constant = sign * (line[j, axis] - seen.bounds[j, side] * line[j, 2])
            slope = sign * (line[j, axis + 3] - seen.bounds[j, side] * line[j, 5])
            if slope > 0.0:
                low = max(low, -constant / slope)
            elif slope < 0.0:
                high = min(high, -constant / slope)
            elif constant < 0.0:
                low = FURTHEST_M
        first, second = max(first, low), max(second, min(first, low))
        last, before = min(last, high), min(before, max(last, high))
    if second >= before:
        return 1.0, 0.0, 1.0
    middle = 0.5 * (second + before)
    for k in range(judges):
        j = order[k]
        z = max(line[j, 2] + middle * line[j, 5], NEAREST_M)
        px, py = line[j, 3] * line[j, 2] - line[j, 0] * line[j, 5], line[j, 4] * line[j, 2] - line[j, 1] * line[j, 5]
        if seen.lens[j, REACH] > 0.0:
            px, py = seen.lens[j, 0] * px, seen.lens[j, 3] * py
        finest = max(finest, np.sqrt(px * px + py * py) / (z * z))
    return second, before, max(STRIDE / max(finest, 1e-9), (before - second) / MOST_STEPS)


@njit(cache=True, error_model="numpy")
def changed(before: Silhouettes, after: Silhouettes) -> Floats:
    """How much each view's silhouette changed, (v,): pixels in one of both only, as a share of those in `after`; NaN where
    one of them is empty."""
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


@njit(cache=True, error_model="numpy")
def _area(seen: Silhouettes, j: int) -> int:
    area = 0
    for k in range(seen.at[j], seen.at[j] + seen.box[j, 2] * seen.box[j, 3]):
        area += seen.pixels[k] != 0
    return area
