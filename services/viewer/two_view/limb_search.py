"""Overlapped tri-tree search of one limb, compiled.  [Two-view 3.3-3.5]

A limb is an upper and a lower part.  A search turns it about one axis by an angle t; t = 0 is the current direction, since
[Two-view 3.5] centres the search region on the previous angle.
"""

from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.jit import kernel
from zenocap.common.vision.model_image import ADD, COUNT, REMOVE, cover_pair, score_of_counts
from zenocap.services.viewer.parameters import BACKWARD_KNEE, MIN_FLEX_COS, STOP


class CoverImage(NamedTuple):
    """A silhouette and the model drawn over it, in one view.

    torso_to_world: (3, 3).  camera: (5, 3) rows.  mask, cover: (height, width).  totals: (3,), see `model_image`.
    """

    torso_to_world: Floats
    camera: Floats
    mask: Mask
    cover: Mask
    totals: Ints


class LimbBody(NamedTuple):
    """Geometry of one limb.

    origin: (3,) of its spherical joint in the world, metres.  sizes: (2, 3) height and radii of both parts, metres.
    is_leg: the flexion joint bends backward only.
    """

    origin: Floats
    sizes: Floats
    is_leg: bool


# Parts turned by a search.
BOTH = 0  # the whole limb, about its spherical joint
LOWER = 1  # the lower part, about the flexion joint
FOLD = 2  # the upper part by t and the lower part by -t: the foot stays below the hip  [Two-view 3.4, squatting]
UPPER = 3  # the upper part; the lower part keeps its direction


@kernel
def turn_vector(vector: Floats, axis: Floats, angle: float, out: Floats) -> None:
    """out = vector turned about the unit vector `axis` by `angle` radians (Rodrigues); all (3,)."""
    c, s = np.cos(angle), np.sin(angle)
    dot = axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]
    out[0] = vector[0] * c + (axis[1] * vector[2] - axis[2] * vector[1]) * s + axis[0] * dot * (1 - c)
    out[1] = vector[1] * c + (axis[2] * vector[0] - axis[0] * vector[2]) * s + axis[1] * dot * (1 - c)
    out[2] = vector[2] * c + (axis[0] * vector[1] - axis[1] * vector[0]) * s + axis[2] * dot * (1 - c)


@kernel
def turn_limb(directions: Floats, axis: Floats, segment: int, angle: float, out: Floats) -> None:
    """out (2, 3) = limb directions (2, 3) after turning `segment` by `angle` radians about `axis` (3,)."""
    for k in range(3):  # no slice assignments: numba compiles its error texts for each, which takes seconds
        out[0, k] = directions[0, k]
        out[1, k] = directions[1, k]
    if segment != LOWER:
        turn_vector(directions[0], axis, angle, out[0])
    if segment != UPPER:
        turn_vector(directions[1], axis, -angle if segment == FOLD else angle, out[1])


@kernel
def is_allowed(directions: Floats, is_leg: bool) -> bool:
    """True when elbow or knee bend within their limits; directions (2, 3) in the torso's frame (X is the flexion axis)."""
    u, w = directions[0], directions[1]
    if u[0] * w[0] + u[1] * w[1] + u[2] * w[2] < MIN_FLEX_COS:
        return False
    return not is_leg or u[1] * w[2] - u[2] * w[1] > BACKWARD_KNEE


@kernel
def segment_frame(origin: Floats, along: Floats, torso_to_world: Floats, frame: Floats) -> None:
    """Write frame (3, 4), part to world: +Y along `along` (3,) of the torso's frame, at `origin` (3,) of the world."""
    r = torso_to_world
    side = 2 if abs(along[0]) > 0.9 else 0  # the axis of the torso that becomes the X of the part, made orthogonal
    dot = norm = 0.0
    for row in range(3):
        frame[row, 1] = r[row, 0] * along[0] + r[row, 1] * along[1] + r[row, 2] * along[2]
        frame[row, 3] = origin[row]
        dot += r[row, side] * frame[row, 1]
    for row in range(3):
        frame[row, 0] = r[row, side] - dot * frame[row, 1]
        norm += frame[row, 0] ** 2
    norm = np.sqrt(norm)
    for row in range(3):
        frame[row, 0] /= norm
    frame[0, 2] = frame[1, 0] * frame[2, 1] - frame[2, 0] * frame[1, 1]
    frame[1, 2] = frame[2, 0] * frame[0, 1] - frame[0, 0] * frame[2, 1]
    frame[2, 2] = frame[0, 0] * frame[1, 1] - frame[1, 0] * frame[0, 1]


@kernel
def cover_limb(directions: Floats, limb: LimbBody, image: CoverImage, mode: int, totals: Ints) -> None:
    """Add, remove or count a limb along `directions` (2, 3) of the torso's frame; changes cover and totals."""
    frames = np.empty((2, 3, 4))
    segment_frame(limb.origin, directions[0], image.torso_to_world, frames[0])
    elbow = np.empty(3)
    for row in range(3):
        elbow[row] = limb.origin[row] + limb.sizes[0, 0] * frames[0, row, 1]
    segment_frame(elbow, directions[1], image.torso_to_world, frames[1])
    cover_pair(frames, limb.sizes, image.camera, image.mask, image.cover, mode, totals)


@kernel
def add_limb(
    directions: Floats, limb: LimbBody, twin_directions: Floats, twin: LimbBody, image: CoverImage
) -> tuple[int, int]:
    """Add a limb to the cover.  Returns its pixels that only its twin may cover, and those of them in the silhouette."""
    totals = image.totals
    cover_limb(twin_directions, twin, image, REMOVE, totals)
    model, both = totals[1], totals[2]
    cover_limb(directions, limb, image, ADD, totals)
    own, inside = totals[1] - model, totals[2] - both
    cover_limb(twin_directions, twin, image, ADD, totals)
    return own, inside


@kernel
def slant_axis(view_axis: Floats, direction: Floats) -> Floats:
    """(3,) unit vector in the image plane about which a part along `direction` (3,) tilts out of the image plane."""
    across = np.empty(3)
    y = np.empty(3)
    for k in range(3):
        y[k] = direction[k]
    norm = 0.0
    for _ in range(2):
        across[0] = view_axis[1] * y[2] - view_axis[2] * y[1]
        across[1] = view_axis[2] * y[0] - view_axis[0] * y[2]
        across[2] = view_axis[0] * y[1] - view_axis[1] * y[0]
        norm = np.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
        if norm >= 0.05:
            break
        y[0], y[1], y[2] = 0.0, 1.0, 0.0  # the part points along the view axis: any axis in the image plane serves
    for k in range(3):
        across[k] /= norm
    return across


@kernel
def limb_score(directions: Floats, axis: Floats, segment: int, angle: float, limb: LimbBody, image: CoverImage) -> float:
    """Matching score of the whole model with the limb turned; -1 where the joint limits forbid it.

    The cover must be without the limb.
    """
    trial = np.empty((2, 3))
    turn_limb(directions, axis, segment, angle, trial)
    # Paper (added): a turn beyond the limits of elbow or knee scores -1.
    if not is_allowed(trial, limb.is_leg):
        return -1.0
    counted = image.totals.copy()
    cover_limb(trial, limb, image, COUNT, counted)
    return score_of_counts(counted[0], counted[1], counted[2])


@kernel
def tri_tree(
    directions: Floats, axis: Floats, segment: int, region: float, limb: LimbBody, image: CoverImage
) -> tuple[float, float, int]:
    """Overlapped tri-tree search of the turn t: (best turn in radians, its score, matchings).  [Two-view 3.5]

    region: width of the first search region, radians, centred on t = 0.  Each stage compares the left end, the centre and
    the right end of the region.  The half around the best one is the next region, in which one or two scores are known
    already.  Of equal scores the centre wins, then the left end.
    """
    # Paper (corrected): 3.5 step 2 swaps left and right; the jump of step 3 cannot fire with known scores and is left out.
    # Paper (open): 3.5 does not decide ties; the centre wins, then the left.
    width, centre = region, 0.0
    s_middle = limb_score(directions, axis, segment, centre, limb, image)
    matchings = 1
    s_left = s_right = -2.0
    best, best_score = centre, s_middle
    while True:
        left, right = centre - width / 2, centre + width / 2
        if s_left < -1.5:
            s_left = limb_score(directions, axis, segment, left, limb, image)
            matchings += 1
        if s_right < -1.5:
            s_right = limb_score(directions, axis, segment, right, limb, image)
            matchings += 1
        if s_left > s_middle and s_left >= s_right:
            if s_left > best_score:
                best, best_score = left, s_left
            centre, s_right, s_middle = left + width / 4, s_middle, -2.0
        elif s_right > s_middle:
            if s_right > best_score:
                best, best_score = right, s_right
            centre, s_left, s_middle = right - width / 4, s_middle, -2.0
        else:
            s_left = s_right = -2.0
        width /= 2
        if width <= STOP * 1.001:
            return best, best_score, matchings
        if s_middle < -1.5:
            s_middle = limb_score(directions, axis, segment, centre, limb, image)
            matchings += 1
            if s_middle > best_score:
                best, best_score = centre, s_middle


@kernel
def full_search(
    directions: Floats, axis: Floats, segment: int, region: float, step: float, limb: LimbBody, image: CoverImage
) -> tuple[float, float, int]:
    """Search at every `step` radians of the region: (best turn, its score, matchings).

    Used for lost limbs, and the reference for `tri_tree`.  Of equal scores the smaller turn is taken.
    """
    count = int(np.round(region / step)) + 1
    best, best_score = 0.0, -2.0
    for k in range(count):
        angle = k * step - region / 2
        score = limb_score(directions, axis, segment, angle, limb, image)
        if score > best_score or (score == best_score and abs(angle) < abs(best)):
            best, best_score = angle, score
    return best, best_score, count
