"""The scene points of one instant: where viewing lines touch the visual hull.  [Hybrid III]"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """Rays through the silhouettes' contours, and what of each the other silhouettes let survive.  Y-up world, metres.

    view: (n,) which camera, as an index.  origin: (n, 3) its centre.  direction: (n, 3) unit viewing line, away from it.
    normal: (n, 3) unit, out of the person: viewing line x contour tangent.
    near, far: (n,) distances along the viewing line between which the hull survives.  A ray that no other view confirms
    is not in the scene.
    """

    view: NDArray[np.int64]
    origin: Floats
    direction: Floats
    normal: Floats
    near: Floats
    far: Floats

    @property
    def points(self) -> Floats:
        """(n, 3) the middle of every surviving interval."""
        middle: Floats = self.origin + (0.5 * (self.near + self.far))[:, None] * self.direction
        return middle
