"""What a viewer measures of a silhouette in metres, once the integrator says how far the person stands.  [Two-view 2.4]"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.limbs import limb_directions
from common.body.proportions import FRONT_SPAN, HIP_HEIGHT, SIDE_WIDTH, body_from_lengths, stretched_angles
from services.viewer.body_definition import Scale, front_lengths, torso_columns
from services.viewer.body_fit import BodyFit, body_model

Mask = NDArray[np.uint8]

FINE_STEPS = (0.94, 0.97, 1.0, 1.03, 1.06)
# Paper: fine-tunes without bounds; Eq. 1 punishes p twice as much as n, so the body would grow. One pass keeps within 6 %.
FINE_TUNED = ("torso_width", "arm_thickness", "arm_span")


@dataclass(frozen=True)
class Outline:
    """Where a silhouette stands.  column: the torso's centre; top, bottom: first and last row; width: all columns; px."""

    column: float
    top: int
    bottom: int
    width: int

    @property
    def height(self) -> int:
        return self.bottom - self.top + 1

    @property
    def navel_row(self) -> float:
        """The navel's row by body proportions, for an upright person."""
        return self.bottom + 0.5 - HIP_HEIGHT * self.height


def outline(mask: Mask) -> Outline:
    """Raises ValueError for an empty mask."""
    rows = np.flatnonzero(mask.any(axis=1))
    columns = np.flatnonzero(mask.any(axis=0))
    torso = torso_columns(mask)
    return Outline(torso.centre, int(rows[0]), int(rows[-1]), int(columns[-1] - columns[0] + 1))


def looks_like_front(shape: Outline) -> bool:
    """Arms stretched sideways, as the front viewer sees them in the initial posture."""
    return FRONT_SPAN[0] * shape.height <= shape.width <= FRONT_SPAN[1] * shape.height


def looks_like_side(shape: Outline) -> bool:
    return shape.width <= SIDE_WIDTH * shape.height


def fine_tuned(anatomy: Anatomy, mask: Mask, camera: Floats, position: Floats, yaw_rotation: Floats) -> Mapping[str, float]:
    """The front viewer's lengths after fine-tuning by the matching score.  [Two-view 2.4, (c)]

    mask: (height, width).  camera: (5, 3) level camera rows.  position: (3,) navel.  yaw_rotation: (3, 3) torso to world.
    Raises ValueError when the posture is not the initial one.
    """
    depth = float(camera[2] @ position + camera[3, 2])
    lengths = dict(front_lengths(mask, Scale(depth, float(camera[4, 0]), float(camera[4, 2]))))
    stretched = limb_directions(anatomy, stretched_angles(anatomy))

    def score(trial: Mapping[str, float]) -> float:
        # What the side viewer measures is hardly seen from the front.
        hidden = {"torso_depth": 0.7 * trial["torso_width"], "head_depth": trial["head_width"]}
        bdp = body_from_lengths(anatomy, dict(trial) | hidden)
        return BodyFit(body_model(anatomy, bdp), camera, mask).place(position, yaw_rotation, stretched)

    for name in FINE_TUNED:
        trials = [lengths | {name: lengths[name] * step} for step in FINE_STEPS]
        lengths = max(trials, key=score)
    return lengths
