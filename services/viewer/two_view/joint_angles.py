"""Arm and leg joint angle estimation in one view.  [Two-view 3.3, 3.4]

Limbs: 0 right arm, 1 left arm, 2 right leg, 3 left leg.
"""

from math import log

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.segments import exchange_legs
from zenocap.services.viewer.parameters import ARM_REGION, LEG_REGION, RESTART_GAIN, SWEEP_STEP
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.limb_fit import HALF_TURN, LimbFit, LimbResult
from zenocap.services.viewer.two_view.limb_search import BOTH, FOLD, LOWER

RIGHT_LEG, LEFT_LEG = 2, 3
FORWARD_FOLD = np.array([-1.0, 0.0, 0.0])  # a turn about -X_N lifts the knee to the front


def find_arm(fit: BodyFit, k: int, resting: Floats, lost: bool, restart: bool = True) -> LimbResult:
    """Estimate arm k: shoulder, elbow, then their slant out of the image; also from `resting` (2, 3), the hanging arm.

    lost: also search all around.  restart: False to search from the current directions only.
    """
    # Paper (replaced): 3.3 turns an arm about Z_N in the facade and X_N in the flank; here about the axis of the view.
    # Paper (replaced): 3.3 searches no elbow in the flank; here both views search the same.
    # Paper (replaced): 3.3 bounds the elbow by t_ha, with theta_Y = +-90 degrees; here by its flexion alone, in any plane.
    limb = LimbFit(fit, k)

    def nearby() -> None:
        # Paper (replaced): 3.5 has a region of 64 degrees for each arm angle; here 64 three times, then 32 and 16.
        limb.search(BOTH, ARM_REGION)
        limb.search(LOWER, ARM_REGION)
        # Paper (added): slants out of the image, since persons and cameras are off the axes.
        limb.search(BOTH, ARM_REGION, limb.slant_axis(0))
        limb.search(LOWER, ARM_REGION / 2, limb.slant_axis(1))
        limb.search(BOTH, ARM_REGION / 4)

    # Paper (added): 3.3 searches from the previous angle only; here also from the hanging arm, and all around when lost.
    def from_rest() -> None:
        limb.start(resting)
        limb.search(BOTH, ARM_REGION)
        limb.search(LOWER, ARM_REGION)

    def all_around() -> None:
        limb.start(resting)
        limb.sweep(BOTH, 2 * HALF_TURN, SWEEP_STEP)
        nearby()

    nearby()
    if restart:
        limb.retry(from_rest, RESTART_GAIN)
    if lost:
        limb.retry(all_around, RESTART_GAIN)
    return limb.finish()


def find_leg_facade(fit: BodyFit, k: int, squatting: bool) -> LimbResult:
    """Estimate leg k in the facade: sideways from the hip; when squatting also folded, with the foot below the hip."""
    limb = LimbFit(fit, k)
    limb.search(BOTH, LEG_REGION)
    if squatting:
        # Paper (replaced): 3.4 bounds theta_X to 50 degrees; here the knee's flexion bounds it.
        limb.search(FOLD, LEG_REGION, FORWARD_FOLD)
    return limb.finish()


def find_leg_flank(fit: BodyFit, k: int, standing: Floats, lost: bool) -> LimbResult:
    """Estimate leg k in the flank: hip and knee, twice, since an error of one hides that of the other.

    standing: (2, 3) directions of a straight leg.  lost: also search from there, all the way forward and back.
    """
    limb = LimbFit(fit, k)

    def nearby() -> None:
        # Paper (replaced): 3.5 has a region of 32 degrees for legs; here 64 in the flank, then 32, each angle twice.
        limb.search(BOTH, 2 * LEG_REGION)
        limb.search(LOWER, 2 * LEG_REGION)
        limb.search(BOTH, LEG_REGION)
        limb.search(LOWER, LEG_REGION)

    def all_around() -> None:
        limb.start(standing)
        limb.sweep(BOTH, HALF_TURN, SWEEP_STEP)
        limb.sweep(LOWER, HALF_TURN, SWEEP_STEP)
        nearby()

    nearby()
    if lost:
        limb.retry(all_around, RESTART_GAIN)
    return limb.finish()


def leg_exchange_gain(fit: BodyFit) -> float:
    """Log matching score gained in the facade when the legs exchange places, after the same search; restores the fit.

    In the flank the legs are indistinguishable; in the facade the nearer foot is lower in the image.
    """
    # Paper (added): 3.4 has no such test; legs that cross before the camera would stay exchanged.
    for k in (RIGHT_LEG, LEFT_LEG):
        find_leg_facade(fit, k, squatting=False)
    kept, kept_score = fit.directions.copy(), fit.score()
    fit.place(fit.position, fit.torso_to_world, exchange_legs(kept))
    for k in (RIGHT_LEG, LEFT_LEG):
        find_leg_facade(fit, k, squatting=False)
    exchanged_score = fit.score()
    fit.place(fit.position, fit.torso_to_world, kept)
    return log(exchanged_score + 1e-3) - log(kept_score + 1e-3)
