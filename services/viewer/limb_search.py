"""The overlapped tri-tree search of one limb, with its scorer, as one compiled call.  [Two-view 3.3-3.5]

A limb is an upper and a lower part from its joint.  A search turns it about one axis by an angle t around its present
place (t = 0): [Two-view 3.5] centres the region on the previous angle.
"""

from math import radians
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.vision.model_image import ADD, COUNT, REMOVE, cover_pair, score_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.uint8]


class Picture(NamedTuple):
    """What one view compares.  torso_to_world: (3, 3).  camera: (5, 3), mask, cover, totals: see `model_image`."""

    torso_to_world: Floats
    camera: Floats
    mask: Mask
    cover: Mask
    totals: Ints


class LimbBody(NamedTuple):
    """One limb.  origin: (3,) its joint in the world.  sizes: (2, 3) of its two parts.  is_leg: bends backward only.

    expected: (2, 3) directions it is drawn to where the picture says nothing, each weighted by its length (its square is
    how much matching score a full contradiction costs, halved).
    """

    origin: Floats
    sizes: Floats
    is_leg: bool
    expected: Floats


# What turns by t.
BOTH = 0  # the limb as it is, about its joint
LOWER = 1  # the lower part, about the flexion joint
FOLD = 2  # the upper part by t and the lower one by -t: the foot stays beneath  [Two-view 3.4, squatting]
UPPER = 3  # the upper part, while the lower one keeps its direction

# Region widths and the step to stop, in radians.  [Two-view 3.5]
ARM_REGION, LEG_REGION, STOP = radians(64), radians(32), radians(4)

MIN_FLEX_COS = float(np.cos(radians(150)))  # the flexion limit of elbow and knee
BACKWARD_KNEE = -0.12  # sine of the largest backward bending of a knee that noise may show


@njit(cache=True, error_model="numpy")
def turn_vector(vector: Floats, axis: Floats, angle: float, out: Floats) -> None:
    """out = vector turned about the unit vector `axis` by `angle` (Rodrigues); all (3,)."""
    c, s = np.cos(angle), np.sin(angle)
    dot = axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]
    out[0] = vector[0] * c + (axis[1] * vector[2] - axis[2] * vector[1]) * s + axis[0] * dot * (1 - c)
    out[1] = vector[1] * c + (axis[2] * vector[0] - axis[0] * vector[2]) * s + axis[1] * dot * (1 - c)
    out[2] = vector[2] * c + (axis[0] * vector[1] - axis[1] * vector[0]) * s + axis[2] * dot * (1 - c)


@njit(cache=True, error_model="numpy")
def turn_limb(directions: Floats, axis: Floats, what: int, angle: float, out: Floats) -> None:
    """out (2, 3) = the limb's directions (2, 3) after turning `what` by `angle` about `axis` (3,)."""
    if what == LOWER:
        out[0] = directions[0]
        turn_vector(directions[1], axis, angle, out[1])
    elif what == UPPER:
        turn_vector(directions[0], axis, angle, out[0])
        out[1] = directions[1]
    else:
        turn_vector(directions[0], axis, angle, out[0])
        turn_vector(directions[1], axis, -angle if what == FOLD else angle, out[1])


@njit(cache=True, error_model="numpy")
def allowed(directions: Floats, is_leg: bool) -> bool:
    """Whether elbow or knee bend within their limits; directions (2, 3) in the torso's frame (X is the flexion axis)."""
    u, w = directions[0], directions[1]
    if u[0] * w[0] + u[1] * w[1] + u[2] * w[2] < MIN_FLEX_COS:
        return False
    return not is_leg or u[1] * w[2] - u[2] * w[1] > BACKWARD_KNEE


@njit(cache=True, error_model="numpy")
def segment_frame(origin: Floats, along: Floats, torso_to_world: Floats, frame: Floats) -> None:
    """Write frame (3, 4): +Y along `along` (3,) of the torso's frame, at `origin` (3,) of the world."""
    r = torso_to_world
    side = 2 if abs(along[0]) > 0.9 else 0  # the torso's axis that is turned into the part's X
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


@njit(cache=True, error_model="numpy")
def cover_limb(directions: Floats, limb: LimbBody, picture: Picture, mode: int, totals: Ints) -> None:
    """Add, remove or count a limb along `directions` (2, 3) of the torso's frame; changes cover and totals."""
    frames = np.empty((2, 3, 4))
    segment_frame(limb.origin, directions[0], picture.torso_to_world, frames[0])
    elbow = np.empty(3)
    for row in range(3):
        elbow[row] = limb.origin[row] + limb.sizes[0, 0] * frames[0, row, 1]
    segment_frame(elbow, directions[1], picture.torso_to_world, frames[1])
    cover_pair(frames, limb.sizes, picture.camera, picture.mask, picture.cover, mode, totals)


@njit(cache=True, error_model="numpy")
def put_back(
    directions: Floats, limb: LimbBody, twin_directions: Floats, twin: LimbBody, picture: Picture
) -> tuple[int, int]:
    """Add a limb to the cover: its pixels that nothing but its twin covers, and those of them in the silhouette."""
    totals = picture.totals
    cover_limb(twin_directions, twin, picture, REMOVE, totals)
    model, both = totals[1], totals[2]
    cover_limb(directions, limb, picture, ADD, totals)
    own, inside = totals[1] - model, totals[2] - both
    cover_limb(twin_directions, twin, picture, ADD, totals)
    return own, inside


@njit(cache=True, error_model="numpy")
def slant_axis(view_axis: Floats, direction: Floats) -> Floats:
    """(3,) unit vector in the image plane about which a part along `direction` tips out of it."""
    across = np.empty(3)
    norm = 0.0
    y = direction
    for _ in range(2):
        across[0] = view_axis[1] * y[2] - view_axis[2] * y[1]
        across[1] = view_axis[2] * y[0] - view_axis[0] * y[2]
        across[2] = view_axis[0] * y[1] - view_axis[1] * y[0]
        norm = np.sqrt(across[0] ** 2 + across[1] ** 2 + across[2] ** 2)
        if norm >= 0.05:
            break
        y = np.array([0.0, 1.0, 0.0])  # it points along the view: any axis will do
    return across / norm


@njit(cache=True, error_model="numpy")
def limb_score(directions: Floats, axis: Floats, what: int, angle: float, limb: LimbBody, picture: Picture) -> float:
    """Matching score of the whole model with the limb turned; the cover is without the limb.  -1 where not allowed."""
    trial = np.empty((2, 3))
    turn_limb(directions, axis, what, angle, trial)
    if not allowed(trial, limb.is_leg):
        return -1.0
    counted = picture.totals.copy()
    cover_limb(trial, limb, picture, COUNT, counted)
    drawn = 0.0
    for part in range(2):
        for k in range(3):
            drawn += trial[part, k] * limb.expected[part, k]
    return score_of(counted[0], counted[1], counted[2]) + drawn


@njit(cache=True, error_model="numpy")
def tri_tree(
    directions: Floats,
    axis: Floats,
    what: int,
    region: float,
    low: float,
    high: float,
    limb: LimbBody,
    picture: Picture,
) -> tuple[float, float, int]:
    """Overlapped tri-tree search of the turn t within [low, high]: (best turn, its score, matchings).  [Two-view 3.5]

    region: width of the first search region, radians.  It is centred on t = 0 and moved to lie within [low, high].
    Each stage compares the region's left extreme, centre and right extreme; the winner's half is the next region, of
    which one or two scores are known already.  A tie stays at the centre.
    """
    width = min(region, high - low)
    centre = min(max(0.0, low + width / 2), high - width / 2)
    s_middle = limb_score(directions, axis, what, centre, limb, picture)
    matchings = 1
    s_left = s_right = -2.0
    best, best_score = centre, s_middle
    while True:
        left, right = centre - width / 2, centre + width / 2
        if s_left < -1.5:
            s_left = limb_score(directions, axis, what, left, limb, picture)
            matchings += 1
        if s_right < -1.5:
            s_right = limb_score(directions, axis, what, right, limb, picture)
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
            s_middle = limb_score(directions, axis, what, centre, limb, picture)
            matchings += 1
            if s_middle > best_score:
                best, best_score = centre, s_middle


@njit(cache=True, error_model="numpy")
def full_search(
    directions: Floats, axis: Floats, what: int, region: float, low: float, high: float, step: float, limb: LimbBody,
    picture: Picture,
) -> tuple[float, float, int]:  # fmt: skip
    """Every `step` of the region: (best turn, its score, matchings).  The oracle, and the search for a lost limb."""
    width = min(region, high - low)
    centre = min(max(0.0, low + width / 2), high - width / 2)
    count = int(np.round(width / step)) + 1
    best, best_score = centre, -2.0
    for k in range(count):
        angle = centre - width / 2 + k * step
        score = limb_score(directions, axis, what, angle, limb, picture)
        if score > best_score or (score == best_score and abs(angle) < abs(best)):
            best, best_score = angle, score
    return best, best_score, count
