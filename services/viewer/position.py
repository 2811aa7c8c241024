"""Object tracking: where the person is in one view, and how the torso tilts and turns there.  [Two-view 3.2]"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from common.body.torso import TURNS, turned_about
from common.vision.model_image import ADD, REMOVE
from services.viewer.body_fit import BodyFit, BodyModel, core_score, cover_body
from services.viewer.limb_search import Picture

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
                        best[:] = trial
                        best_score = score
            if best[0] == start[0] and best[1] == start[1] and best[2] == start[2]:
                break
        if scale == 1:
            return best, best_score
        scale = 1


def sight(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> Sight:
    """Shift the model image to the silhouette, then tilt and turn its torso.  The fit is left with the torso tilted."""
    mask = fit.picture.mask
    fit.place(position, torso_to_world, directions)
    coarse = max(1, round(mask.shape[0] / PAPER_ROWS))
    found, score = shift_body(position, torso_to_world, directions, fit.model, fit.picture, fit.metres_per_pixel(), coarse)
    fit.place(found, torso_to_world, directions)
    turns = tuple(_turn_score(fit, found, torso_to_world, directions, turn) for turn in TURNS)
    fit.place(found, torso_to_world, directions)
    return Sight(found, score, _tilt(fit), turns)


def _turn_score(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats, turn: float) -> float:
    turned = turned_about(np.array([0.0, 1.0, 0.0]), turn) @ torso_to_world
    return float(np.log(fit.place(position, turned, directions) + 1e-3))


def _tilt(fit: BodyFit) -> float:
    """Turn of torso and head about the view's axis by the overlapped tri-tree, the limbs staying where they are."""
    axis = fit.torso_to_world @ fit.view_axis()
    fit.core(REMOVE)
    scores: dict[float, float] = {}

    def score(angle: float) -> float:
        if angle not in scores:
            turned = turned_about(axis, angle) @ fit.torso_to_world
            scores[angle] = core_score(fit.position, turned, fit.model, fit.picture)
        return scores[angle]

    centre, width = 0.0, TILT_REGION
    while width > TILT_STOP * 1.001:
        trials = (centre, centre - width / 2, centre + width / 2)
        winner = max(range(3), key=lambda k: (score(trials[k]), -k))
        centre += (0.0, -width / 4, width / 4)[winner]
        width /= 2
    fit.core(ADD)
    return max(scores, key=lambda angle: (scores[angle], -abs(angle)))
