"""Leg joint angle estimation in one view.  [Two-view 3.4]"""

from math import log, radians

import numpy as np

from common.body.anatomy import Floats
from common.body.limbs import legs_exchanged
from services.viewer.body_fit import BodyFit
from services.viewer.limb_fit import FREE, LimbFit, LimbResult
from services.viewer.limb_search import BOTH, FOLD, LEG_REGION, LOWER

RIGHT, LEFT = 2, 3
SWEEP_STEP = radians(15)
WORTH = 0.004  # matching score that another start must gain
FORWARD_FOLD = np.array([-1.0, 0.0, 0.0])  # a turn about -X_N lifts the knee to the front


def find_leg_facade(fit: BodyFit, k: int, squatting: bool) -> LimbResult:
    """Leg k in the facade: sideways from the hip; when squatting, also folded with the foot beneath."""
    search = LimbFit(fit, k)
    search.turn(BOTH, LEG_REGION)
    if squatting:
        search.turn(FOLD, LEG_REGION, FORWARD_FOLD)
    return search.done()


def find_leg_flank(fit: BodyFit, k: int, standing: Floats, lost: bool) -> LimbResult:
    """Leg k in the flank: hip and knee, twice, since each hides the other's error.

    standing: (2, 3) a straight leg's directions.  lost: also look for it from there, all the way forward and back.
    """
    search = LimbFit(fit, k)

    def near() -> None:
        search.turn(BOTH, 2 * LEG_REGION)
        search.turn(LOWER, 2 * LEG_REGION)
        search.turn(BOTH, LEG_REGION)
        search.turn(LOWER, LEG_REGION)

    def all_ways() -> None:
        search.start(standing)
        search.sweep(BOTH, FREE, SWEEP_STEP)
        search.sweep(LOWER, FREE, SWEEP_STEP)
        near()

    near()
    if lost:
        search.better_of(all_ways, WORTH)
    return search.done()


def exchange_gain(fit: BodyFit) -> float:
    """Log matching score gained in the facade when the legs exchange their places, after a fair search; the fit is kept.

    The flank cannot tell the legs apart: the facade can, since the nearer foot stands lower in the image.
    """
    for k in (RIGHT, LEFT):
        find_leg_facade(fit, k, squatting=False)
    kept, kept_score, expected = fit.directions.copy(), fit.score(), fit.expected
    fit.expected = legs_exchanged(expected, unit=False)
    fit.place(fit.position, fit.torso_to_world, legs_exchanged(kept))
    for k in (RIGHT, LEFT):
        find_leg_facade(fit, k, squatting=False)
    other_score = fit.score()
    fit.expected = expected
    fit.place(fit.position, fit.torso_to_world, kept)
    return log(other_score + 1e-3) - log(kept_score + 1e-3)
