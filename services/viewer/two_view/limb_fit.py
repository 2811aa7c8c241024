"""Search of one limb in one view."""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.vision.model_image import REMOVE
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.limb_search import add_limb, full_search, slant_axis, tri_tree, turn_limb

HALF_TURN = pi


@dataclass(frozen=True)
class LimbResult:
    """Result of the searches of one limb.

    directions: (2, 3) in the torso's frame.  score: matching score of the whole model.  visible: visibility of the limb in
    [0, 1], the share of its area that torso and other limbs leave uncovered and that is in the silhouette.
    matchings: of every tri-tree search.
    """

    directions: Floats
    score: float
    visible: float
    matchings: tuple[int, ...]


class LimbFit:
    """Searches of limb k.  axis: (3,) view axis in the torso's frame.  Mutable; made for one step."""

    def __init__(self, fit: BodyFit, k: int) -> None:
        self.fit, self.k = fit, k
        self.axis = fit.view_axis
        self.body = fit.limb_body(k)
        self.matchings: tuple[int, ...] = ()
        fit.cover_limb(k, REMOVE)
        self.start(fit.directions[k])

    def start(self, directions: Floats) -> None:
        """Restart from `directions` (2, 3)."""
        self.directions, self.score = directions, -2.0

    def search(self, segment: int, region: float, axis: Floats | None = None) -> None:
        """Tri-tree search within `region` radians about `axis` (3,), the view axis by default."""
        axis = self.axis if axis is None else axis
        # Paper (replaced): 3.5 moves the region into the joint's range; here it stays centred, see `limb_score`.
        angle, score, matchings = tri_tree(self.directions, axis, segment, region, self.body, self.fit.image)
        self.matchings += (matchings,)
        self._apply(segment, axis, angle, score)

    def sweep(self, segment: int, region: float, step: float) -> None:
        """Full search at every `step` radians of `region` about the view axis, for a lost limb."""
        angle, score, _ = full_search(self.directions, self.axis, segment, region, step, self.body, self.fit.image)
        self._apply(segment, self.axis, angle, score)

    def retry(self, search: Callable[[], None], gain: float) -> None:
        """Run another search and keep its result if it improves the matching score by at least `gain`."""
        directions, score = self.directions, self.score
        search()
        if self.score < score + gain:
            self.directions, self.score = directions, score

    def _apply(self, segment: int, axis: Floats, angle: float, score: float) -> None:
        if score >= self.score:
            out = np.empty((2, 3))
            turn_limb(self.directions, axis, segment, angle, out)
            self.directions, self.score = out, score

    def slant_axis(self, part: int) -> Floats:
        """(3,) axis in the image plane about which a part (0 upper, 1 lower) tilts out of it."""
        return slant_axis(self.axis, self.directions[part])

    def finish(self) -> LimbResult:
        """Add the limb to the model at the result of the search."""
        fit, k = self.fit, self.k
        fit.directions[k] = self.directions
        twin = k ^ 1  # the other arm or leg, which may cover the same pixels
        own, inside = add_limb(self.directions, self.body, fit.directions[twin], fit.limb_body(twin), fit.image)
        area = fit.limb_areas[k] / fit.metres_per_pixel() ** 2
        visible = min(1.0, own / max(area, 1.0)) * max(0.0, 2 * inside - own) / max(own, 1)
        return LimbResult(self.directions, fit.score(), visible, self.matchings)
