"""Intersection of viewing lines with the silhouettes of other views.  [Hybrid III]

On a viewing line a view's pixel is (a + d * b) / (c + d * e) of the depth d, so a step costs one division per view.  A
point outside the hull is mostly outside the same silhouette as its neighbour: that view is tested first.
"""

import numpy as np

from zenocap.common.arrays import Bools, Bytes, Floats, Ints
from zenocap.common.jit import inlined_kernel, kernel, leaf_kernel
from zenocap.services.tracker.hull.views import REACH, Silhouettes, distort, undistort
from zenocap.services.tracker.parameters import (
    BISECTIONS,
    MAX_DEPTH_M,
    MAX_RAY_STEPS,
    MIN_DEPTH_M,
    MIN_INTERVAL_RATIO,
    RAY_STEP_PX,
)

# Paper (open): [Hybrid III] has no rule for several intervals of one line; here they are joined.
INTERVALS = 16
OUTSIDE, INSIDE, UNSEEN = 0, 1, 2


@kernel
def surviving_intervals(view: Ints, directions: Floats, silhouettes: Silhouettes, near: Floats, far: Floats) -> None:
    """Write near, far (n,): depths in metres between which each viewing line is inside the hull; near > far: nowhere.

    A point survives when it is in the silhouette of every view in whose image it is, and of at least one view.
    Several intervals of one line are joined, except those much shorter than the longest.
    """
    views = len(silhouettes.lens)
    turn, start = relative_frames(silhouettes)
    bent = silhouettes.lens[:, REACH].copy()
    line, order = np.empty((views, 9)), np.empty(views, dtype=np.int64)
    _intersect(view, directions, silhouettes, turn, start, bent, line, order, np.empty((INTERVALS, 2)), near, far)


@leaf_kernel
def _intersect(
    view: Ints, directions: Floats, silhouettes: Silhouettes, turn: Floats, start: Floats, bent: Floats,
    line: Floats, order: Ints, found: Floats, near: Floats, far: Floats,
) -> None:  # fmt: skip
    """Write near, far of `surviving_intervals`; line, order, found: scratch."""
    lens, box, size, at, pixels = silhouettes.lens, silhouettes.box, silhouettes.size, silhouettes.at, silhouettes.pixels
    for i in range(len(view)):
        near[i], far[i] = 1.0, 0.0
        rejecting = other_views(
            view[i], directions[i, 0], directions[i, 1], directions[i, 2], turn, start, box, bent, line, order
        )
        first, last, step = _depth_range(line, order, rejecting, lens, silhouettes.bounds, silhouettes.whole)
        if rejecting == 0 or first >= last:
            continue
        count, inside = 0, False
        steps = int((last - first) / step) + 1
        for k in range(steps + 1):
            depth = first + k * step
            survives = k < steps and _inside(depth, line, order, rejecting, lens, box, size, at, pixels)
            if survives == inside:
                continue
            inside = survives
            good, bad = (depth, depth - step) if survives else (depth - step, depth)
            for _ in range(BISECTIONS if k > 0 else 0):
                middle = 0.5 * (good + bad)
                if _inside(middle, line, order, rejecting, lens, box, size, at, pixels):
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
            if found[k, 1] - found[k, 0] >= MIN_INTERVAL_RATIO * longest:
                near[i] = found[k, 0] if near[i] > far[i] else near[i]
                far[i] = found[k, 1]


@leaf_kernel
def other_views(
    own: int, dx: float, dy: float, dz: float, turn: Floats, start: Floats, box: Ints, bent: Floats,
    line: Floats, order: Ints,
) -> int:  # fmt: skip
    """Number of views that can reject points of a viewing line, listed in `order` (v,).

    line: (v, 9), overwritten: the line in each view, at depth 0 and per metre, then box size and lens radius.
    """
    rejecting = 0
    for j in range(len(turn)):
        if j == own or box[j, 2] == 0:
            continue
        order[rejecting] = j
        rejecting += 1
        for a in range(3):
            line[j, a] = start[own, j, a]
            line[j, a + 3] = turn[j, a, 0] * dx + turn[j, a, 1] * dy + turn[j, a, 2] * dz
        line[j, 6], line[j, 7], line[j, 8] = box[j, 2], box[j, 3], bent[j]
    return rejecting


@leaf_kernel
def _depth_range(
    line: Floats, order: Ints, rejecting: int, lens: Floats, bounds: Floats, whole: Bools
) -> tuple[float, float, float]:
    """First and last depth within all boxes of the silhouettes, and the depth step of RAY_STEP_PX in the finest view."""
    first, last = MIN_DEPTH_M, MAX_DEPTH_M
    for k in range(rejecting):
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
                constant, slope = line[j, 2] - MIN_DEPTH_M, line[j, 5]
            if slope > 0.0:
                first = max(first, -constant / slope)
            elif slope < 0.0:
                last = min(last, -constant / slope)
            elif constant < 0.0:
                return 1.0, 0.0, 1.0
    longest = 1.0
    for k in range(rejecting):
        j = order[k]
        z0, z1 = line[j, 2] + first * line[j, 5], line[j, 2] + last * line[j, 5]
        if z0 >= MIN_DEPTH_M and z1 >= MIN_DEPTH_M:
            dx = (line[j, 0] + last * line[j, 3]) / z1 - (line[j, 0] + first * line[j, 3]) / z0
            dy = (line[j, 1] + last * line[j, 4]) / z1 - (line[j, 1] + first * line[j, 4]) / z0
            if lens[j, REACH] > 0.0:
                dx, dy = lens[j, 0] * dx, lens[j, 3] * dy
            longest = max(longest, np.sqrt(dx * dx + dy * dy))
    return first, last, (last - first) / min(max(longest / RAY_STEP_PX, 1.0), float(MAX_RAY_STEPS))


@inlined_kernel
def _inside(
    depth: float, line: Floats, order: Ints, rejecting: int, lens: Floats, box: Ints, size: Ints, at: Ints, pixels: Bytes
) -> bool:
    """True when the point at a depth survives.  A view that rejects it is moved to the front of `order`."""
    checked = False
    for k in range(rejecting):
        j = order[k]
        location = inside_view(depth, j, line, lens, box, size, at, pixels)
        if location == OUTSIDE:
            order[k] = order[0]
            order[0] = j
            return False
        checked |= location == INSIDE
    return checked


@inlined_kernel
def inside_view(depth: float, j: int, line: Floats, lens: Floats, box: Ints, size: Ints, at: Ints, pixels: Bytes) -> int:
    """OUTSIDE, INSIDE or UNSEEN (not in the image): the point at a depth in view j."""
    z = line[j, 2] + depth * line[j, 5]
    if z < MIN_DEPTH_M:
        return UNSEEN
    scale = 1.0 / z
    u, v = scale * (line[j, 0] + depth * line[j, 3]), scale * (line[j, 1] + depth * line[j, 4])
    if line[j, 8] > 0.0:
        if u * u + v * v > lens[j, REACH]:
            return UNSEEN
        x, y = distort(lens, j, u, v)
        u = lens[j, 0] * x + lens[j, 1] * y + lens[j, 2] + 0.5 - box[j, 0]
        v = lens[j, 3] * y + lens[j, 4] + 0.5 - box[j, 1]
    if u >= 0.0 and v >= 0.0 and u < line[j, 6] and v < line[j, 7]:
        return INSIDE if pixels[at[j] + int(v) * box[j, 2] + int(u)] != 0 else OUTSIDE
    u += box[j, 0]
    v += box[j, 1]
    return UNSEEN if u < 0.0 or v < 0.0 or u >= size[j, 0] or v >= size[j, 1] else OUTSIDE


@kernel
def viewing_lines(view: Ints, points: Floats, tangents: Floats, silhouettes: Silhouettes) -> tuple[Floats, Floats]:
    """Unit directions (n, 3) and unit normals (n, 3) in the world, of contour points and tangents (n, 2) px.

    The normal is viewing line x tangent, out of the person.
    """
    directions, normals = np.empty((len(view), 3)), np.empty((len(view), 3))
    for i in range(len(view)):
        j = view[i]
        length = np.hypot(tangents[i, 0], tangents[i, 1])
        du, dv = tangents[i, 0] / length, tangents[i, 1] / length
        x, y = undistort(silhouettes.lens, j, points[i, 0], points[i, 1])
        ahead_x, ahead_y = undistort(silhouettes.lens, j, points[i, 0] + du, points[i, 1] + dv)
        tx, ty = ahead_x - x, ahead_y - y
        nx, ny, nz = -ty, tx, x * ty - y * tx
        forward, outward = 1.0 / np.sqrt(x * x + y * y + 1.0), 1.0 / np.sqrt(nx * nx + ny * ny + nz * nz)
        for k in range(3):
            directions[i, k] = forward * (
                silhouettes.rotation[j, 0, k] * x + silhouettes.rotation[j, 1, k] * y + silhouettes.rotation[j, 2, k]
            )
            normals[i, k] = outward * (
                silhouettes.rotation[j, 0, k] * nx + silhouettes.rotation[j, 1, k] * ny + silhouettes.rotation[j, 2, k] * nz
            )
    return directions, normals


@kernel
def relative_frames(silhouettes: Silhouettes) -> tuple[Floats, Floats]:
    """Rotations and relative positions of the views.

    turn: (v, 3, 3) world directions to a view's X, Y, Z.  start: (v, v, 3) centre of view i in view k.
    Without a lens X and Y are in pixels of the crop times Z, offset by half a pixel so that truncation rounds.
    """
    views = len(silhouettes.lens)
    turn, start = np.empty((views, 3, 3)), np.zeros((views, views, 3))
    for j in range(views):
        lens = silhouettes.lens[j]
        for b in range(3):
            x, y, z = silhouettes.rotation[j, 0, b], silhouettes.rotation[j, 1, b], silhouettes.rotation[j, 2, b]
            turn[j, 0, b], turn[j, 1, b], turn[j, 2, b] = x, y, z
            if lens[REACH] == 0.0:
                turn[j, 0, b] = lens[0] * x + lens[1] * y + (lens[2] + 0.5 - silhouettes.box[j, 0]) * z
                turn[j, 1, b] = lens[3] * y + (lens[4] + 0.5 - silhouettes.box[j, 1]) * z
        for own in range(views):
            for a in range(3):
                for b in range(3):
                    start[own, j, a] += turn[j, a, b] * (silhouettes.centre[own, b] - silhouettes.centre[j, b])
    return turn, start
