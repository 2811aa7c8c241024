"""Body definition (BDP) and pose (BAP) as arrays, ordered by an `Anatomy`.  [Two-view 2.1, Table 1]"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy


@dataclass(frozen=True)
class Bdp:
    """Body definition: sizes of a person.

    sizes: (parts, 3) height along Y, long radius along X, short radius along Z of every part, metres.
    offsets: (joints, 3) position of every joint in its parent part's frame, metres; the first, of the navel, is zero.
    tips: (parts, 2) long and short radius at the far end of tapered parts, metres; None where all are cylinders.
    bases: (parts, 3) where each part's axis begins in its own frame, metres; None where all begin at their joints.
    """

    sizes: Floats
    offsets: Floats
    tips: Floats | None = None
    bases: Floats | None = None

    @property
    def far_radii(self) -> Floats:
        """(parts, 2) long and short radius at the far ends, metres."""
        return self.sizes[:, 1:] if self.tips is None else self.tips

    @property
    def starts(self) -> Floats:
        """(parts, 3) where each part's axis begins in its own frame, metres."""
        return np.zeros((len(self.sizes), 3)) if self.bases is None else self.bases


@dataclass(frozen=True)
class Pose:
    """position: (3,) navel in the world, metres.  angles: (angles,) radians, in the order of `Anatomy.angles`."""

    position: Floats
    angles: Floats


def neutral_pose(anatomy: Anatomy, position: Floats, yaw: float = 0.0) -> Pose:
    """Upright pose at `position` (3,) metres, `yaw` radians from +Z towards +X."""
    angles = anatomy.neutral.copy()
    angles[anatomy.index["navel.y"]] = yaw
    return Pose(np.asarray(position, dtype=np.float64), angles)
