"""One limb taken off the body model, searched in one view, and put back."""

from collections.abc import Callable
from dataclasses import dataclass
from math import radians

import numpy as np

from common.body.anatomy import Floats
from common.vision.model_image import REMOVE
from services.viewer.body_fit import BodyFit
from services.viewer.limb_search import full_search, put_back, slant_axis, tri_tree, turn_limb

FREE = radians(180)


@dataclass(frozen=True)
class LimbResult:
    """directions: (2, 3) in the torso's frame.  score: of the whole model.  visible: how far the view shows the limb, in
    [0, 1]: the share of its area that torso and other limbs leave bare and that fits the silhouette.

    matchings: of every tri-tree search that found it.
    """

    directions: Floats
    score: float
    visible: float
    matchings: tuple[int, ...]


class LimbFit:
    """The searches of one limb.  axis: (3,) the view's axis in the torso's frame."""

    def __init__(self, fit: BodyFit, k: int) -> None:
        self.fit, self.k = fit, k
        self.axis = fit.view_axis
        self.body = fit.limb_body(k)
        self.matchings: tuple[int, ...] = ()
        fit.limb(k, REMOVE)
        self.start(fit.directions[k])

    def start(self, directions: Floats) -> None:
        """Begin anew from `directions` (2, 3)."""
        self.directions, self.score = directions, -2.0

    def turn(self, what: int, region: float, axis: Floats | None = None) -> None:
        """A tri-tree search about `axis`, the view's axis if none is given."""
        axis = self.axis if axis is None else axis
        angle, score, matchings = tri_tree(self.directions, axis, what, region, -FREE, FREE, self.body, self.fit.picture)
        self.matchings += (matchings,)
        self._apply(what, axis, angle, score)

    def sweep(self, what: int, region: float, step: float) -> None:
        """Every `step` of a region about the view's axis: for a limb that is lost."""
        angle, score, _ = full_search(
            self.directions, self.axis, what, region, -FREE, FREE, step, self.body, self.fit.picture
        )
        self._apply(what, self.axis, angle, score)

    def better_of(self, other: Callable[[], None], worth: float) -> None:
        """Search anew by `other`, and keep what it finds if that gains at least `worth` of matching score."""
        directions, score = self.directions, self.score
        other()
        if self.score < score + worth:
            self.directions, self.score = directions, score

    def _apply(self, what: int, axis: Floats, angle: float, score: float) -> None:
        if score >= self.score:
            out = np.empty((2, 3))
            turn_limb(self.directions, axis, what, angle, out)
            self.directions, self.score = out, score

    def slant_axis(self, part: int) -> Floats:
        """The axis in the image plane about which a part tips out of it."""
        return slant_axis(self.axis, self.directions[part])

    def done(self) -> LimbResult:
        """Put the limb back where it was found."""
        fit, k = self.fit, self.k
        fit.directions[k] = self.directions
        twin = k ^ 1  # both arms or both legs may lie one over the other
        own, inside = put_back(self.directions, self.body, fit.directions[twin], fit.limb_body(twin), fit.picture)
        area = fit.limb_areas[k] / fit.metres_per_pixel() ** 2
        visible = min(1.0, own / max(area, 1.0)) * max(0.0, 2 * inside - own) / max(own, 1)
        return LimbResult(self.directions, fit.score(), visible, self.matchings)
