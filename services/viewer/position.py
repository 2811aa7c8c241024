"""Object tracking: where the person is in one view, and how the torso tilts and turns there.  [Two-view 3.2]"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from common.body.torso import TURNS
from services.viewer.body_fit import ARMLESS, WHOLE, BodyFit, BodyModel, cover_body
from services.viewer.limb_search import Picture, turn_vector

SHIFTS_PX = np.array([-5, -2, -1, 1, 2, 5])  # [Two-view 3.2]; 0, which the paper leaves out, is where the search stands
PAPER_ROWS = 120  # the image height those shifts are for
ROUNDS = 4
PIVOTS = (1.0, 0.0)  # torso lengths above the navel about which the torso tilts: the neck, then the navel
LONGEST, STRAIGHT_M = 0.9999, 0.01  # of a stretched leg; how far the knee of a straight one stands out, metres
TILT_REGION, TILT_STOP = np.radians(32), np.radians(2)


@dataclass(frozen=True)
class Sight:
    """position: (3,) navel at the depth assumed.  score: Eq. 1 there.  tilt: turn of the torso about the view's axis.

    turns: log matching scores of the whole body turned by `TURNS` about the vertical.
    """

    position: Floats
    score: float
    tilt: float
    turns: tuple[float, ...]


@njit(cache=True, error_model="numpy")
def shift_body(
    position: Floats, torso_to_world: Floats, directions: Floats, model: BodyModel, picture: Picture,
    metres_per_px: float, coarse: int, planting: bool,
) -> tuple[Floats, float]:  # fmt: skip
    """Shift the whole model in the image to its best score, first in steps of `coarse` px, then of one.

    planting: the feet stay where they are, see `planted`.
    Returns the new navel (3,) and the score; cover and totals are those of the last shift tried.
    """
    limbs = directions.copy()
    best = position.copy()
    best_score = cover_body(best, torso_to_world, directions, model, picture, ARMLESS)
    scale = coarse
    while True:
        for _ in range(ROUNDS):
            start = best.copy()
            for axis in range(2):
                for shift in SHIFTS_PX:
                    trial = start.copy()
                    for k in range(3):
                        trial[k] += shift * scale * metres_per_px * picture.camera[axis, k]
                    if planting:
                        planted(position, torso_to_world, directions, trial, torso_to_world, model, limbs)
                    score = cover_body(trial, torso_to_world, limbs, model, picture, ARMLESS)
                    if score > best_score:
                        best, best_score = trial, score
            if best[0] == start[0] and best[1] == start[1] and best[2] == start[2]:
                break
        if scale == 1:
            return best, best_score
        scale = 1


@njit(cache=True, error_model="numpy")
def turn_scores(
    position: Floats, torso_to_world: Floats, directions: Floats, model: BodyModel, picture: Picture, turns: Floats
) -> Floats:
    """(n,) log matching scores of the whole body turned by `turns` (n,) radians about the vertical."""
    scores = np.empty(turns.shape[0])
    turned = np.empty((3, 3))
    for k in range(turns.shape[0]):
        c, s = np.cos(turns[k]), np.sin(turns[k])
        for column in range(3):
            turned[0, column] = c * torso_to_world[0, column] + s * torso_to_world[2, column]
            turned[1, column] = torso_to_world[1, column]
            turned[2, column] = c * torso_to_world[2, column] - s * torso_to_world[0, column]
        scores[k] = np.log(cover_body(position, turned, directions, model, picture, WHOLE) + 1e-3)
    return scores


@njit(cache=True, error_model="numpy")
def tilt_body(
    position: Floats, torso_to_world: Floats, directions: Floats, axis: Floats, height: float, model: BodyModel,
    picture: Picture,
) -> float:  # fmt: skip
    """Turn of torso and head about `axis` (3,) of the world by the overlapped tri-tree.

    The point at `height` metres above the navel stays, and the feet.  position (3,), torso_to_world (3, 3)
    and directions (4, 2, 3) become those of the best turn, whose angle is returned.  A tie stays.
    """
    trial, turned, turned_directions = np.empty(3), np.empty((3, 3)), np.empty((4, 2, 3))
    best, best_score = 0.0, -1.0
    centre, width = 0.0, TILT_REGION
    while width > TILT_STOP * 1.001:
        winner, winner_score = 0.0, -1.0
        for part in (0.0, -0.5, 0.5):
            angle = centre + part * width
            _tilted(position, torso_to_world, directions, axis, height, angle, model, trial, turned, turned_directions)
            score = cover_body(trial, turned, turned_directions, model, picture, ARMLESS)
            if score > winner_score:
                winner, winner_score = part, score
            if score > best_score or (score == best_score and abs(angle) < abs(best)):
                best, best_score = angle, score
        centre += winner / 2 * width
        width /= 2
    _tilted(position, torso_to_world, directions, axis, height, best, model, trial, turned, turned_directions)
    position[:], torso_to_world[:], directions[:] = trial, turned, turned_directions
    return best


@njit(cache=True, error_model="numpy")
def _tilted(
    position: Floats, torso_to_world: Floats, directions: Floats, axis: Floats, height: float, angle: float,
    model: BodyModel, trial: Floats, turned: Floats, turned_directions: Floats,
) -> None:  # fmt: skip
    column = np.empty(3)
    for k in range(3):
        turn_vector(torso_to_world[:, k].copy(), axis, angle, column)
        for row in range(3):
            turned[row, k] = column[row]
    for row in range(3):
        trial[row] = position[row] + height * (torso_to_world[row, 1] - turned[row, 1])
    planted(position, torso_to_world, directions, trial, turned, model, turned_directions)


@njit(cache=True, error_model="numpy")
def planted(
    position: Floats, torso_to_world: Floats, directions: Floats, moved: Floats, turned: Floats, model: BodyModel,
    out: Floats,
) -> None:  # fmt: skip
    """Limb directions (4, 2, 3) after the torso went from `position`, `torso_to_world` to `moved`, `turned`.

    The arms keep their directions in the world, the feet their places: each knee stays on its side of the line from hip to
    foot, a straight leg bends to the front.  A foot out of reach is drawn along.
    """
    part = np.empty((2, 3))
    for limb in range(4):
        for row in range(3):
            for k in range(2):
                part[k, row] = 0.0
                for column in range(3):
                    part[k, row] += torso_to_world[row, column] * directions[limb, k, column]
        if limb >= 2:
            upper, lower = model.limbs[limb, 0, 0], model.limbs[limb, 1, 0]
            knee, foot, distance = np.empty(3), np.empty(3), 0.0
            for row in range(3):
                hip = moved[row] - position[row]
                for column in range(3):
                    hip += (turned[row, column] - torso_to_world[row, column]) * model.origins[limb, column]
                knee[row] = upper * part[0, row] - hip
                foot[row] = knee[row] + lower * part[1, row]
                distance += foot[row] ** 2
            distance = np.sqrt(distance)
            if distance > abs(upper - lower) + 1e-3:
                along = foot / distance
                distance = min(distance, LONGEST * (upper + lower))
                side = knee - (knee[0] * along[0] + knee[1] * along[1] + knee[2] * along[2]) * along
                norm = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
                if norm < STRAIGHT_M:
                    for row in range(3):
                        side[row] += STRAIGHT_M * turned[row, 2]
                    norm = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
                reach = (upper**2 - lower**2 + distance**2) / (2 * distance)
                bend = np.sqrt(max(upper**2 - reach**2, 0.0))
                for row in range(3):
                    bent = reach * along[row] + bend * side[row] / max(norm, 1e-9)
                    part[0, row] = bent / upper
                    part[1, row] = (distance * along[row] - bent) / lower
        for k in range(2):
            for column in range(3):
                out[limb, k, column] = 0.0
                for row in range(3):
                    out[limb, k, column] += turned[row, column] * part[k, row]


def sight(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> Sight:
    """Shift the model image to the silhouette, then tilt and turn its torso.  The fit is left at the found place.

    Without arms: one that is not where it was would be taken for the torso's shape, and the torso moved instead.
    """
    coarse = max(1, round(fit.image_rows / PAPER_ROWS))
    fit.place(position, torso_to_world, directions)
    step, axis = fit.metres_per_pixel(), torso_to_world @ fit.view_axis
    shape = fit.model, fit.picture
    found, _ = shift_body(position, torso_to_world, directions, *shape, step, coarse, False)
    torso, limbs = torso_to_world.copy(), directions.copy()
    tilt = 0.0
    for height in PIVOTS:
        tilt += tilt_body(found, torso, limbs, axis, height * float(fit.model.neck[1]), *shape)
    found, _ = shift_body(found, torso, limbs, *shape, step, coarse, True)
    turns = turn_scores(found, torso, limbs, *shape, TURNS)
    score = fit.place(found, torso_to_world, directions)
    return Sight(found, float(score), float(tilt), tuple(float(turn) for turn in turns))
