"""Object tracking: where the person is in one view, and how the torso tilts and turns there.  [Two-view 3.2]"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from common.body.torso import TURNS
from common.vision.model_image import ADD, REMOVE
from services.viewer.body_fit import BodyFit, BodyModel, core_score, cover_body
from services.viewer.limb_search import Picture, turn_vector

SHIFTS_PX = np.array([-5, -2, -1, 1, 2, 5])  # [Two-view 3.2]; 0, which the paper leaves out, is where the search stands
PAPER_ROWS = 120  # the image height those shifts are for
ROUNDS = 4
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
    best_score = cover_body(best, torso_to_world, directions, model, picture)
    scale = coarse
    while True:
        for _ in range(ROUNDS):
            start = best.copy()
            for axis in range(2):
                for shift in SHIFTS_PX:
                    trial = start.copy()
                    for k in range(3):
                        trial[k] += shift * scale * metres_per_px * picture.camera[axis, k]
                    score = cover_body(trial, torso_to_world, directions, model, picture)
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
        scores[k] = np.log(cover_body(position, turned, directions, model, picture) + 1e-3)
    return scores


@njit(cache=True, error_model="numpy")
def tilt_core(position: Floats, torso_to_world: Floats, axis: Floats, model: BodyModel, picture: Picture) -> float:
    """Turn of torso and head about `axis` (3,) of the world by the overlapped tri-tree, the limbs staying where they are.

    The cover holds the limbs only.  A tie stays.
    """
    turned = np.empty((3, 3))
    column = np.empty(3)
    best, best_score = 0.0, -1.0
    centre, width = 0.0, TILT_REGION
    while width > TILT_STOP * 1.001:
        winner, winner_score = 0.0, -1.0
        for part in (0.0, -0.5, 0.5):
            angle = centre + part * width
            for k in range(3):
                turn_vector(torso_to_world[:, k].copy(), axis, angle, column)
                for row in range(3):
                    turned[row, k] = column[row]
            score = core_score(position, turned, model, picture)
            if score > winner_score:
                winner, winner_score = part, score
            if score > best_score or (score == best_score and abs(angle) < abs(best)):
                best, best_score = angle, score
        centre += winner / 2 * width
        width /= 2
    return best


def sight(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> Sight:
    """Shift the model image to the silhouette, then tilt and turn its torso.  The fit is left at the found place."""
    coarse = max(1, round(fit.picture.mask.shape[0] / PAPER_ROWS))
    fit.place(position, torso_to_world, directions)
    step = fit.metres_per_pixel()
    found, score = shift_body(position, torso_to_world, directions, fit.model, fit.picture, step, coarse)
    turns = turn_scores(found, torso_to_world, directions, fit.model, fit.picture, TURNS)
    fit.place(found, torso_to_world, directions)
    fit.core(REMOVE)
    tilt = tilt_core(found, torso_to_world, torso_to_world @ fit.view_axis, fit.model, fit.picture)
    fit.core(ADD)
    return Sight(found, float(score), float(tilt), tuple(float(turn) for turn in turns))
