"""Facade or flank: the width of the upper body in one view.  [Two-view 3.1]"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.uint8]
View = Literal["facade", "flank"]

THRESHOLD = 0.65  # Paper: the torso's height h, against columns of 1.2 h: a slight bow and the torso is gone
FEET, SHINS = 0.03, (0.06, 0.11)  # heights of the body at which feet and shins are looked for
BELOW_HIPS = 0.2  # y_hip = y_c + 0.2 h


def upper_body_width(mask: Mask, hip_row: float, torso_height_px: float) -> int:
    """W_u-body in px: between the outermost columns with more than 0.65 h of silhouette above y_hip.

    mask: (height, width).  hip_row: y_c, row of the navel.  torso_height_px: h times the perspective scaling factor.
    0 when no column is high enough.
    """
    bottom = int(np.clip(round(hip_row + BELOW_HIPS * torso_height_px), 0, mask.shape[0]))
    projection = np.count_nonzero(mask[:bottom], axis=0)
    high = np.flatnonzero(projection > THRESHOLD * torso_height_px)
    return int(high[-1] - high[0] + 1) if high.size else 0


def toes_offset(mask: Mask) -> float:
    """How far the feet reach past the shins above them to the right of the image, px: where a person in the flank faces.

    Paper: cannot tell front from back.  mask: (height, width).  0 when no foot is seen.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        return 0.0
    lowest, height = int(rows[-1]) + 1, int(rows[-1] - rows[0]) + 1
    feet = np.flatnonzero(mask[lowest - max(2, round(FEET * height)) : lowest].any(axis=0))
    left, right = int(feet[0]), int(feet[-1]) + 1
    shins = np.nonzero(mask[lowest - round(SHINS[1] * height) : lowest - round(SHINS[0] * height), left:right])[1]
    return float(feet.mean() - left - shins.mean()) if shins.size else 0.0


def own_view(view: View, width: float, low: float, high: float) -> View:
    """The viewer's own decision: flank below `low`, facade above `high`, otherwise unchanged."""
    if width < low:
        return "flank"
    return "facade" if width > high else view
