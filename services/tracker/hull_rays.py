"""Viewing lines cut with the silhouettes of the other views: where on each line the visual hull survives.  [Hybrid III]

On a viewing line a view's pixel is (a + d * b) / (c + d * e) of the depth d, so a step costs one division a view.  A place
outside the hull is mostly outside the silhouette that its neighbour was outside of: that view is asked first.
"""

import numpy as np
from numba import njit

from services.tracker.hull_views import Bytes, Flags, Floats, Integers, Silhouettes, frames_of
from services.tracker.lens import REACH, shifted

NEAREST_M, FURTHEST_M = 0.1, 50.0
MOST_STEPS = 4000
STRIDE = 2.0  # px between the places that are looked at: dilated silhouettes are hardly ever thinner
HALVINGS = 3  # of a stride, where an interval begins and ends
SHARE = 1 / 3  # of the longest interval's length that another must have to count
INTERVALS = 16
NO, YES, UNSEEN = 0, 1, 2


@njit(cache=True, error_model="numpy")
def survive(view: Integers, directions: Floats, seen: Silhouettes, near: Floats, far: Floats) -> None:
    """near, far (n,): metres along each viewing line between which the hull survives; near > far where it does not.

    A place survives when every view that has it in its image has it in its silhouette, and one view at least does.
    Several intervals on one line are spanned together, but for those that are short beside the longest.
    """
    views = len(seen.lens)
    turn, start = frames_of(seen)
    lens, box, size, at, pixels = seen.lens, seen.box, seen.size, seen.at, seen.pixels
    bent = lens[:, REACH].copy()
    line = np.empty((views, 9))
    order = np.empty(views, dtype=np.int64)
    found = np.empty((INTERVALS, 2))
    for i in range(len(view)):
        near[i], far[i] = 1.0, 0.0
        judges = judges_of(
            view[i], directions[i, 0], directions[i, 1], directions[i, 2], turn, start, box, bent, line, order
        )
        first, last, step = _reach(line, order, judges, lens, seen.bounds, seen.whole)
        if judges == 0 or first >= last:
            continue
        count, inside = 0, False
        steps = int((last - first) / step) + 1
        for k in range(steps + 1):
            depth = first + k * step
            survives = k < steps and _inside(depth, line, order, judges, lens, box, size, at, pixels)
            if survives == inside:
                continue
            inside = survives
            good, bad = (depth, depth - step) if survives else (depth - step, depth)
            for _ in range(HALVINGS if k > 0 else 0):
                middle = 0.5 * (good + bad)
                if _inside(middle, line, order, judges, lens, box, size, at, pixels):
                    good = middle
                else:
                    bad = middle
            found[count, 0 if survives else 1] = good
            count += 0 if survives else 1
            if count == INTERVALS:
                break
        longest = 0.0
        for k in range(count):
            longest = max(longest, found[k, 1] - found[k, 0])
        for k in range(count):
            if found[k, 1] - found[k, 0] >= SHARE * longest:
                near[i] = found[k, 0] if near[i] > far[i] else near[i]
                far[i] = found[k, 1]


@njit(cache=True, error_model="numpy")
def judges_of(
    own: int,
    dx: float,
    dy: float,
    dz: float,
    turn: Floats,
    start: Floats,
    box: Integers,
    bent: Floats,
    line: Floats,
    order: Integers,
) -> int:
    """How many views judge a viewing line; `order` (v,) is filled with them, `line` (v, 6) with what they have at depth 0
    and what a metre adds."""
    judges = 0
    for j in range(len(turn)):
        if j == own or box[j, 2] == 0:
            continue
        order[judges] = j
        judges += 1
        for a in range(3):
            line[j, a] = start[own, j, a]
            line[j, a + 3] = turn[j, a, 0] * dx + turn[j, a, 1] * dy + turn[j, a, 2] * dz
        line[j, 6], line[j, 7], line[j, 8] = box[j, 2], box[j, 3], bent[j]
    return judges


@njit(cache=True, error_model="numpy")
def _reach(
    line: Floats, order: Integers, judges: int, lens: Floats, bounds: Floats, whole: Flags
) -> tuple[float, float, float]:
    """Between which depths the silhouettes' boxes let a viewing line live, and the depth of a pixel where it is finest."""
    first, last = NEAREST_M, FURTHEST_M
    for k in range(judges):
        j = order[k]
        if not whole[j]:
            continue
        for side in range(5):
            # x / z >= least is x - least * z >= 0, linear in the depth, as z > 0.
            if side < 4:
                sign, axis = (1.0 if side % 2 == 0 else -1.0), side // 2
                constant = sign * (line[j, axis] - bounds[j, side] * line[j, 2])
                slope = sign * (line[j, axis + 3] - bounds[j, side] * line[j, 5])
            else:
                constant, slope = line[j, 2] - NEAREST_M, line[j, 5]
            if slope > 0.0:
                first = max(first, -constant / slope)
            elif slope < 0.0:
                last = min(last, -constant / slope)
            elif constant < 0.0:
                return 1.0, 0.0, 1.0
    longest = 1.0
    for k in range(judges):
        j = order[k]
        z0, z1 = line[j, 2] + first * line[j, 5], line[j, 2] + last * line[j, 5]
        if z0 >= NEAREST_M and z1 >= NEAREST_M:
            dx = (line[j, 0] + last * line[j, 3]) / z1 - (line[j, 0] + first * line[j, 3]) / z0
            dy = (line[j, 1] + last * line[j, 4]) / z1 - (line[j, 1] + first * line[j, 4]) / z0
            if lens[j, REACH] > 0.0:
                dx, dy = lens[j, 0] * dx, lens[j, 3] * dy
            longest = max(longest, np.sqrt(dx * dx + dy * dy))
    return first, last, (last - first) / min(max(longest / STRIDE, 1.0), float(MOST_STEPS))


@njit(cache=True, error_model="numpy", inline="always")
def _inside(
    depth: float,
    line: Floats,
    order: Integers,
    judges: int,
    lens: Floats,
    box: Integers,
    size: Integers,
    at: Integers,
    pixels: Bytes,
) -> bool:
    """Whether the place at a depth survives.  A view that says no comes first in `order` afterwards."""
    judged = False
    for k in range(judges):
        j = order[k]
        z = line[j, 2] + depth * line[j, 5]
        if z < NEAREST_M:
            continue
        scale = 1.0 / z
        u, v = scale * (line[j, 0] + depth * line[j, 3]), scale * (line[j, 1] + depth * line[j, 4])
        if line[j, 8] > 0.0:
            if u * u + v * v > lens[j, REACH]:
                continue
            x, y = shifted(lens, j, u, v)
            u = lens[j, 0] * x + lens[j, 1] * y + lens[j, 2] + 0.5 - box[j, 0]
            v = lens[j, 3] * y + lens[j, 4] + 0.5 - box[j, 1]
        if u >= 0.0 and v >= 0.0 and u < line[j, 6] and v < line[j, 7]:
            if pixels[at[j] + int(v) * box[j, 2] + int(u)] != 0:
                judged = True
                continue
        else:
            u += box[j, 0]
            v += box[j, 1]
            if u < 0.0 or v < 0.0 or u >= size[j, 0] or v >= size[j, 1]:
                continue
        order[k] = order[0]
        order[0] = j
        return False
    return judged


@njit(cache=True, error_model="numpy")
def verdict(
    depth: float, j: int, line: Floats, lens: Floats, box: Integers, size: Integers, at: Integers, pixels: Bytes
) -> int:
    """What view j says to the place at a depth: NO, YES, or UNSEEN when it is not in its image."""
    z = line[j, 2] + depth * line[j, 5]
    if z < NEAREST_M:
        return UNSEEN
    scale = 1.0 / z
    u, v = scale * (line[j, 0] + depth * line[j, 3]), scale * (line[j, 1] + depth * line[j, 4])
    if lens[j, REACH] > 0.0:
        if u * u + v * v > lens[j, REACH]:
            return UNSEEN
        x, y = shifted(lens, j, u, v)
        u = lens[j, 0] * x + lens[j, 1] * y + lens[j, 2] + 0.5 - box[j, 0]
        v = lens[j, 3] * y + lens[j, 4] + 0.5 - box[j, 1]
    if u >= 0.0 and v >= 0.0 and u < box[j, 2] and v < box[j, 3]:
        return YES if pixels[at[j] + int(v) * box[j, 2] + int(u)] != 0 else NO
    u += box[j, 0]
    v += box[j, 1]
    return UNSEEN if u < 0.0 or v < 0.0 or u >= size[j, 0] or v >= size[j, 1] else NO
