"""The joint angles of one limb in one view: a short sequence of tri-tree searches.  [Two-view 3.3, 3.4]

In the facade a limb turns about Z_N, in the flank about X_N: both are the torso's axis that looks out of the image.  What
the view cannot see of a limb, its slant out of the image plane, is what the other view last found, and is searched last.
"""

from dataclasses import dataclass
from math import radians

import numpy as np

from common.body.anatomy import Floats
from common.vision.model_image import ADD, REMOVE
from services.viewer.body_fit import BodyFit
from services.viewer.limb_search import ARM_REGION, BOTH, FOLD, LEG_REGION, LOWER, full_search, tri_tree, turn_limb

FREE = radians(180)
X_AXIS, Z_AXIS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LimbResult:
    """directions: (2, 3) in the torso's frame.  score: Eq. 1 of the whole model.  visible, inside: shares in [0, 1] of the
    limb's own pixels (no other part's) and of those the silhouette has.  matchings: of the tri-tree searches."""

    directions: Floats
    score: float
    visible: float
    inside: float
    matchings: int


def _slant_axis(axis: Floats, upper: Floats) -> Floats:
    """The axis in the image plane about which the limb tips out of it."""
    across = np.cross(axis, upper)
    norm = float(np.linalg.norm(across))
    return across / norm if norm > 0.05 else np.cross(axis, np.array([0.0, 1.0, 0.0]))


class LimbFit:
    """One limb taken off a body fit, searched, and put back."""

    def __init__(self, fit: BodyFit, k: int, axis: Floats) -> None:
        self.fit, self.k, self.axis = fit, k, axis
        self.body = fit.limb_body(k)
        fit.limb(k, REMOVE)
        self.directions = fit.directions[k]
        self.matchings = 0
        self.score = -2.0

    def turn(
        self, what: int, region: float, axis: Floats | None = None, low: float = -FREE, high: float = FREE
    ) -> None:
        axis = self.axis if axis is None else axis
        angle, score, matchings = tri_tree(self.directions, axis, what, region, low, high, self.body, self.fit.picture)
        self.matchings += matchings
        self.apply(what, axis, angle, score)

    def sweep(self, what: int, region: float, step: float, axis: Floats | None = None) -> None:
        axis = self.axis if axis is None else axis
        angle, score, _ = full_search(
            self.directions, axis, what, region, -FREE, FREE, step, self.body, self.fit.picture
        )
        if score > self.score + 1e-9:
            self.apply(what, axis, angle, score)

    def apply(self, what: int, axis: Floats, angle: float, score: float) -> None:
        if score >= self.score or self.score < -1:
            out = np.empty((2, 3))
            turn_limb(self.directions, axis, what, angle, out)
            self.directions = out
            self.score = score

    def done(self) -> LimbResult:
        fit = self.fit
        fit.directions[self.k] = self.directions
        before = fit.totals.copy()
        fit.limb(self.k, ADD)
        own = int(fit.totals[1] - before[1])
        inside = int(fit.totals[2] - before[2])
        area = max(1.0, float(np.sum(self.body.sizes[:, 0] * 2 * self.body.sizes[:, 1])) / fit.metres_per_pixel() ** 2)
        return LimbResult(self.directions, fit.score(), min(own / area, 1.0), inside / max(own, 1), self.matchings)


def find_arm(fit: BodyFit, k: int, axis: Floats) -> LimbResult:
    """One arm: about the view's axis from the shoulder, then the elbow, then how far it slants out of the image."""
    search = LimbFit(fit, k, axis)
    search.turn(BOTH, ARM_REGION)
    search.turn(LOWER, ARM_REGION)
    search.turn(BOTH, ARM_REGION, _slant_axis(axis, search.directions[0]))
    search.turn(LOWER, ARM_REGION / 2, _slant_axis(axis, search.directions[1]))
    search.turn(BOTH, ARM_REGION / 4)
    return search.done()


def find_leg_facade(fit: BodyFit, k: int, squatting: bool, axis: Floats) -> LimbResult:
    """One leg in the facade: sideways from the hip; when squatting, also folded with the foot beneath.  [Two-view 3.4]"""
    search = LimbFit(fit, k, axis)
    search.turn(BOTH, LEG_REGION)
    if squatting:
        search.turn(FOLD, LEG_REGION, -X_AXIS)
    return search.done()


def find_leg_flank(fit: BodyFit, k: int, axis: Floats) -> LimbResult:
    """One leg in the flank: hip and knee about X_N.  [Two-view 3.4]"""
    search = LimbFit(fit, k, axis)
    search.turn(BOTH, LEG_REGION * 2)
    search.turn(LOWER, LEG_REGION * 2)
    search.turn(BOTH, LEG_REGION)
    search.turn(LOWER, LEG_REGION)
    return search.done()
