"""Measurements of one silhouette: box, upper body, feet, indicated view.  [Two-view 3.1]"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from zenocap.common.arrays import Mask
from zenocap.common.body.proportions import FRONT_SPAN, HIP_HEIGHT, SIDE_WIDTH
from zenocap.services.viewer.parameters import BELOW_HIPS, FOOT_BAND, SHIN_BAND, UPPER_BODY_COLUMN
from zenocap.services.viewer.two_view.body_definition import torso_columns

View = Literal["facade", "flank"]


@dataclass(frozen=True)
class SilhouetteBox:
    """Position of a silhouette in px.

    column: centre of the torso.  top, bottom: first and last row.  width: from the first to the last column.
    """

    column: float
    top: int
    bottom: int
    width: int

    @property
    def height(self) -> int:
        """Rows, px."""
        return self.bottom - self.top + 1

    @property
    def navel_row(self) -> float:
        """Row of the navel of an upright person, by body proportions."""
        return self.bottom + 0.5 - HIP_HEIGHT * self.height


def silhouette_box(mask: Mask) -> SilhouetteBox:
    """Position of the silhouette.  Raises ValueError for an empty mask."""
    rows = np.flatnonzero(mask.any(axis=1))
    columns = np.flatnonzero(mask.any(axis=0))
    torso = torso_columns(mask)
    return SilhouetteBox(torso.centre, int(rows[0]), int(rows[-1]), int(columns[-1] - columns[0] + 1))


def is_front_posture(box: SilhouetteBox) -> bool:
    """True for the T-pose in the front view."""
    return FRONT_SPAN[0] * box.height <= box.width <= FRONT_SPAN[1] * box.height


def is_side_posture(box: SilhouetteBox) -> bool:
    """True for a silhouette as narrow as the T-pose in the side view."""
    return box.width <= SIDE_WIDTH * box.height


def upper_body_width(mask: Mask, hip_row: float, torso_height_px: float) -> int:
    """W_u-body in px, between the outermost high columns of the silhouette above y_hip; 0 without such a column.

    mask: (height, width).  hip_row: y_c, row of the navel.  torso_height_px: h times the perspective scaling factor.
    """
    # Paper (corrected): 3.1 requires columns of h; a torso has 1.2 h, so a slight bow leaves none.  Here 0.65 h.
    # Paper (corrected): 3.1 scales y_c, a row, by r_t; here only h is scaled, and y_c is the navel's row now.
    bottom = int(np.clip(round(hip_row + BELOW_HIPS * torso_height_px), 0, mask.shape[0]))
    projection = np.count_nonzero(mask[:bottom], axis=0)
    high = np.flatnonzero(projection > UPPER_BODY_COLUMN * torso_height_px)
    return int(high[-1] - high[0] + 1) if high.size else 0


def toes_offset(mask: Mask) -> float:
    """Distance of the feet from the shins above, px to the right of the image: the direction a person in the flank faces.

    mask: (height, width).  0 when no foot is visible.
    """
    # Paper (added): 5.2 (4) states that a silhouette does not distinguish front from back; the feet do.
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        return 0.0
    lowest, height = int(rows[-1]) + 1, int(rows[-1] - rows[0]) + 1
    feet = np.flatnonzero(mask[lowest - max(2, round(FOOT_BAND * height)) : lowest].any(axis=0))
    left, right = int(feet[0]), int(feet[-1]) + 1
    band = slice(lowest - round(SHIN_BAND[1] * height), lowest - round(SHIN_BAND[0] * height))
    shins = np.nonzero(mask[band, left:right])[1]
    return float(feet.mean() - left - shins.mean()) if shins.size else 0.0


def own_view(view: View, width: float, low: float, high: float) -> View:
    """Decision of one viewer: flank below the threshold `low`, facade above `high`, otherwise unchanged."""
    if width < low:
        return "flank"
    return "facade" if width > high else view
