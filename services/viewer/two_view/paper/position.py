"""Position in one view: shifts of the model image along X, then Y.  [Two-view 3.2, Fig. 9]"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.viewer.parameters import PAPER_ROWS, SHIFTS_PX
from zenocap.services.viewer.two_view.body_fit import BodyFit


@dataclass(frozen=True)
class Shifted:
    """position: (3,) navel at the assumed depth, metres.  score: matching score there."""

    position: Floats
    score: float


def shift(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> Shifted:
    """Best of the paper's shifts along X, then of those along Y from there; leaves the fit at the result.

    position: (3,), torso_to_world: (3, 3), directions: (4, 2, 3) of the last pose.
    """
    # Paper (corrected): 3.2 omits the shift 0, with which a good position is kept.
    # Paper (added): images of more rows than 120 are shifted by proportionally more pixels.
    pixels = max(1, round(fit.image_rows / PAPER_ROWS))
    best, score = np.array(position), fit.place(position, torso_to_world, directions)
    step = pixels * fit.metres_per_pixel()
    for axis in range(2):
        start = best
        for pixels_shifted in SHIFTS_PX:
            trial = start + pixels_shifted * step * fit.image.camera[axis]
            trial_score = fit.place(trial, torso_to_world, directions)
            if trial_score > score:
                best, score = trial, trial_score
    fit.place(best, torso_to_world, directions)
    return Shifted(best, float(score))
