"""Arm joint angle estimation in one view.  [Two-view 3.3]

The facade turns an arm about Z_N and the flank about X_N; for a person who stands between, and for cameras that are not on
the axes, both are the view's own axis.  How far the arm slants out of the image, which the paper fixes, is searched last.
"""

from math import radians

from common.body.anatomy import Floats
from services.viewer.body_fit import BodyFit
from services.viewer.limb_fit import FREE, LimbFit, LimbResult
from services.viewer.limb_search import ARM_REGION, BOTH, LOWER

SWEEP_STEP = radians(15)
WORTH = 0.004  # matching score that another start must gain


def find_arm(fit: BodyFit, k: int, resting: Floats, lost: bool) -> LimbResult:
    """Arm k (0 right, 1 left): shoulder, elbow, then their slant; also begun from `resting` (2, 3), the hanging arm.

    lost: also look all the way round.
    """
    search = LimbFit(fit, k)

    def near() -> None:
        search.turn(BOTH, ARM_REGION)
        search.turn(LOWER, ARM_REGION)
        search.turn(BOTH, ARM_REGION, search.slant_axis(0))
        search.turn(LOWER, ARM_REGION / 2, search.slant_axis(1))
        search.turn(BOTH, ARM_REGION / 4)

    def from_rest() -> None:
        search.start(resting)
        search.turn(BOTH, ARM_REGION)
        search.turn(LOWER, ARM_REGION)

    def all_round() -> None:
        search.start(resting)
        search.sweep(BOTH, 2 * FREE, SWEEP_STEP)
        near()

    near()
    search.better_of(from_rest, WORTH)
    if lost:
        search.better_of(all_round, WORTH)
    return search.done()
