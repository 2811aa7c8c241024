"""Body definition parameters from the initial posture, by each viewer for its own side.  [Two-view 2.4]

The person stands upright with the arms stretched sideways.  All lengths are measured in px of the level view, y down, and
returned in metres by the viewer's scale there.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.uint8]

TORSO_ROWS = (0.22, 0.45)  # from shoulders to hips, from the top of the head, in body heights


@dataclass(frozen=True)
class Torso:
    """The torso's columns [left, right) around `centre`, in px, and the mean column height `avg`.  [Two-view Fig. 5]"""

    left: int
    right: int
    avg: float

    @property
    def width(self) -> int:
        return self.right - self.left

    @property
    def centre(self) -> float:
        return (self.left + self.right - 1) / 2


def vertical_projection(mask: Mask) -> NDArray[np.int64]:
    """P(x): silhouette pixels in every column.  mask: (height, width) of 0 and 1."""
    return np.asarray(np.count_nonzero(mask, axis=0), dtype=np.int64)


def torso_columns(mask: Mask) -> Torso:
    """The outermost columns higher than the mean column, P(x) > avg.  Raises ValueError for an empty mask."""
    projection = vertical_projection(mask)
    inside = np.flatnonzero(projection)
    if inside.size == 0:
        raise ValueError("no person in the silhouette: it is empty")
    avg = float(projection[inside[0] : inside[-1] + 1].mean())
    high = np.flatnonzero(projection > avg)
    if high.size == 0:  # a silhouette of one height throughout
        return Torso(int(inside[0]), int(inside[-1]) + 1, avg)
    return Torso(int(high[0]), int(high[-1]) + 1, avg)


def without_head(mask: Mask, torso_width: int) -> Mask:
    """The silhouette after closing and opening with an element of 0.8 W_torso x 1: the head is gone.  [Two-view Fig. 6]"""
    length = max(3, round(0.8 * torso_width) | 1)  # odd: an even element shifts the mask
    element = np.ones((1, length), np.uint8)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, element)
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, element), dtype=np.uint8)


def front_lengths(mask: Mask, metres_per_px: float) -> Mapping[str, float]:
    """All parameters that the front viewer measures, in metres.  Raises ValueError when the posture is not the initial one.

    height, torso_width, shoulder_line and arm_line (heights above the soles), arm_span, arm_thickness, head_width,
    leg_width.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    torso = torso_columns(mask)
    columns = np.flatnonzero(mask.any(axis=0))
    lowest, highest = int(rows[-1]) + 1, int(rows[0])
    height = lowest - highest
    headless = without_head(mask, torso.width)
    shoulder_rows = np.flatnonzero(headless[: highest + height // 2].any(axis=1))
    if shoulder_rows.size == 0 or shoulder_rows[0] - highest < 0.05 * height:
        raise ValueError("no shoulder line under the head: the arms are not stretched sideways or hide the head")
    shoulder_line = int(shoulder_rows[0])
    arm = _arm_thickness_and_line(mask, torso, columns)
    head = mask[highest : max(shoulder_line - (shoulder_line - highest) // 4, highest + 1)]
    legs = mask[int(lowest - 0.35 * height) : int(lowest - 0.08 * height)]
    m = metres_per_px
    return {
        "height": height * m,
        "torso_width": torso.width * m,
        "shoulder_line": (lowest - shoulder_line) * m,
        "arm_line": (lowest - arm[1]) * m,
        "arm_span": (columns[-1] + 1 - columns[0]) * m,
        "arm_thickness": arm[0] * m,
        "head_width": float(np.max(np.count_nonzero(head, axis=1))) * m,
        "leg_width": float(np.median(np.count_nonzero(legs, axis=1))) / 2 * m,
    }


def side_lengths(mask: Mask, metres_per_px: float) -> Mapping[str, float]:
    """height and torso_depth in metres in the side view.  Raises ValueError for an empty mask."""
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        raise ValueError("no person in the silhouette: it is empty")
    height = int(rows[-1]) + 1 - int(rows[0])
    # Paper: the columns above the mean column, as in the front view; from the side those are the legs as much as the torso.
    torso = mask[int(rows[0] + TORSO_ROWS[0] * height) : int(rows[0] + TORSO_ROWS[1] * height)]
    depth = float(np.median(np.count_nonzero(torso, axis=1)))
    return {"height": height * metres_per_px, "torso_depth": depth * metres_per_px}


def _arm_thickness_and_line(mask: Mask, torso: Torso, columns: NDArray[np.intp]) -> tuple[float, float]:
    """Thickness and middle row of the arms, in px, over the inner three quarters of both."""
    thickness, middle = [], []
    for first, last in ((int(columns[0]), torso.left), (torso.right, int(columns[-1]) + 1)):
        reach = last - first
        if reach < 3:
            raise ValueError("an arm is not stretched sideways: nothing beside the torso")
        inner = range(first + reach // 4, last) if first < torso.left else range(first, last - reach // 4)
        for x in inner:
            on = np.flatnonzero(mask[:, x])
            if on.size:
                thickness.append(on.size)
                middle.append(float(on.mean()))
    return float(np.median(thickness)), float(np.median(middle))
