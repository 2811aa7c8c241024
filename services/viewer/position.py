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
    metres_per_px: float, coarse: int,
) -> tuple[Floats, float]:  # fmt: skip
    """Shift the whole model in the image to its best score, first in steps of `coarse` px, then of one.

    Returns the new navel (3,) and the score; cover and totals are those of the last shift tried.
    """
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
                    score = cover_body(trial, torso_to_world, directions, model, picture, ARMLESS)
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
    """Turn of torso and head about `axis` (3,) of the world by the overlapped tri-tree; the limbs keep their directions.

    The point at `height` metres above the navel stays; the legs move with the hips.  position (3,), torso_to_world (3, 3)
    and directions (4, 2, 3) become those of the best turn, whose angle is returned.  A tie stays.
    """
    trial, turned, turned_directions = np.empty(3), np.empty((3, 3)), np.empty((4, 2, 3))
    best, best_score = 0.0, -1.0
    centre, width = 0.0, TILT_REGION
    while width > TILT_STOP * 1.001:
        winner, winner_score = 0.0, -1.0
        for part in (0.0, -0.5, 0.5):
            angle = centre + part * width
            _tilted(position, torso_to_world, directions, axis, height, angle, trial, turned, turned_directions)
            score = cover_body(trial, turned, turned_directions, model, picture, ARMLESS)
            if score > winner_score:
                winner, winner_score = part, score
            if score > best_score or (score == best_score and abs(angle) < abs(best)):
                best, best_score = angle, score
        centre += winner / 2 * width
        width /= 2
    _tilted(position, torso_to_world, directions, axis, height, best, trial, turned, turned_directions)
    position[:], torso_to_world[:], directions[:] = trial, turned, turned_directions
    return best


@njit(cache=True, error_model="numpy")
def _tilted(
    position: Floats, torso_to_world: Floats, directions: Floats, axis: Floats, height: float, angle: float,
    trial: Floats, turned: Floats, turned_directions: Floats,
) -> None:  # fmt: skip
    column = np.empty(3)
    for k in range(3):
        turn_vector(torso_to_world[:, k].copy(), axis, angle, column)
        turned[:, k] = column
    for row in range(3):
        trial[row] = position[row] + height * (torso_to_world[row, 1] - turned[row, 1])
    for limb in range(4):
        for part in range(2):
            for k in range(3):
                turned_directions[limb, part, k] = 0.0
            for row in range(3):
                along = 0.0
                for k in range(3):
                    along += torso_to_world[row, k] * directions[limb, part, k]
                for k in range(3):
                    turned_directions[limb, part, k] += turned[row, k] * along


def sight(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> Sight:
    """Shift the model image to the silhouette, then tilt and turn its torso.  The fit is left at the found place.

    Without arms: one that is not where it was would be taken for the torso's shape, and the torso moved instead.
    """
    coarse = max(1, round(fit.picture.mask.shape[0] / PAPER_ROWS))
    fit.place(position, torso_to_world, directions)
    step, axis = fit.metres_per_pixel(), torso_to_world @ fit.view_axis
    shape = fit.model, fit.picture
    found, _ = shift_body(position, torso_to_world, directions, *shape, step, coarse)
    torso, limbs = torso_to_world.copy(), directions.copy()
    tilt = 0.0
    for height in PIVOTS:
        tilt += tilt_body(found, torso, limbs, axis, height * float(fit.model.neck[1]), *shape)
    found, _ = shift_body(found, torso, limbs, *shape, step, 1)
    turns = turn_scores(found, torso, limbs, *shape, TURNS)
    score = fit.place(found, torso_to_world, directions)
    return Sight(found, float(score), float(tilt), tuple(float(turn) for turn in turns))
