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

# Bands of the body's height, from the soles upwards, in which its parts are measured: between hips and stretched arms or
# shoulders, the head with its neck, between crotch and knee, between knee and ankle.
TORSO_FRONT, TORSO_SIDE, HEAD, THIGHS, SHINS = (0.54, 0.74), (0.52, 0.78), (0.86, 1.0), (0.32, 0.44), (0.06, 0.26)
# How much nearer than the body the lowest visible sole is, in body heights: the ball of a foot seen from the front, the
# near foot seen from the side.  The foot's length is 0.152 (Drillis and Contini), the ankle a quarter of it from the heel.
FRONT_TOES, SIDE_TOES = 0.06, 0.05

SHORTEST_ARM = 0.2  # of a stretched arm beside the torso, in body heights; it is about 0.37
UNEVEN = 0.10  # body heights that the arms may differ in reach


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


@dataclass(frozen=True)
class Scale:
    """How a level view shows the person.  depth: of the person, m.  focal, horizon: focal length and horizon row, px."""

    depth: float
    focal: float
    horizon: float

    @property
    def metres_per_px(self) -> float:
        return self.depth / self.focal

    def height(self, highest: int, lowest: int, toes: float) -> float:
        """Metres from row `highest` to below row `lowest`, which shows soles that are nearer by `toes` heights.

        The lowest pixels are toes, nearer than the body and so lower in the image than the heels: 2 % of the height.
        """
        above, below = self.horizon - (highest - 0.5), lowest + 0.5 - self.horizon
        nearer = toes * (above + below) * self.metres_per_px
        return (above * self.depth + below * (self.depth - nearer)) / self.focal


def front_lengths(mask: Mask, scale: Scale) -> Mapping[str, float]:
    """All parameters that the front viewer measures, in metres.  Raises ValueError when the posture is not the initial one.

    height, torso_width, arm_span, arm_thickness, head_width, thigh_width, leg_width.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    torso = torso_columns(mask)
    columns = np.flatnonzero(mask.any(axis=0))
    lowest, highest = int(rows[-1]), int(rows[0])
    height = lowest + 1 - highest
    headless = without_head(mask, torso.width)
    shoulder_rows = np.flatnonzero(headless[: highest + height // 2].any(axis=1))
    if shoulder_rows.size == 0 or shoulder_rows[0] - highest < 0.05 * height:
        raise ValueError("no shoulder line under the head: the arms are not stretched sideways or hide the head")
    if abs((columns[0] + columns[-1]) / 2 - torso.centre) > UNEVEN * height:
        raise ValueError("one arm reaches further than the other: stretch both sideways, facing this camera")
    m = scale.metres_per_px
    return {
        "height": scale.height(highest, lowest, FRONT_TOES),
        # Paper: W_torso, columns higher than the mean; whether the shoulders are among them depends on the arms' thickness.
        "torso_width": _mean_width(mask, TORSO_FRONT) * m,
        "arm_span": (columns[-1] + 1 - columns[0]) * m,
        "arm_thickness": _arm_thickness(mask, torso, columns, round(SHORTEST_ARM * height)) * m,
        "head_width": _mean_width(mask, HEAD) * m,
        "thigh_width": _mean_width(mask, THIGHS) / 2 * m,
        "leg_width": _mean_width(mask, SHINS) / 2 * m,
    }


def side_lengths(mask: Mask, scale: Scale) -> Mapping[str, float]:
    """height, torso_depth and head_depth in metres.  Raises ValueError for an empty mask."""
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        raise ValueError("no person in the silhouette: it is empty")
    return {
        "height": scale.height(int(rows[0]), int(rows[-1]), SIDE_TOES),
        # Paper: columns higher than the mean; those are the legs', and the chest and the seat reach past them.
        "torso_depth": _mean_width(mask, TORSO_SIDE) * scale.metres_per_px,
        "head_depth": _mean_width(mask, HEAD) * scale.metres_per_px,
    }


def _mean_width(mask: Mask, band: tuple[float, float]) -> float:
    """Silhouette pixels per row in a band of the person's height, given as shares from the soles upwards."""
    rows = np.flatnonzero(mask.any(axis=1))
    highest, lowest = int(rows[0]), int(rows[-1]) + 1
    first, last = (round(lowest - share * (lowest - highest)) for share in (band[1], band[0]))
    return float(np.count_nonzero(mask[first : max(last, first + 1)])) / max(last - first, 1)


def _arm_thickness(mask: Mask, torso: Torso, columns: NDArray[np.intp], shortest: int) -> float:
    """Thickness of the arms, in px, over the inner three quarters of both."""
    thickness = []
    for first, last in ((int(columns[0]), torso.left), (torso.right, int(columns[-1]) + 1)):
        reach = last - first
        if reach < max(shortest, 3):
            raise ValueError(f"an arm is not stretched sideways: {reach} px beside the torso, at least {shortest} expected")
        inner = range(first + reach // 4, last) if first < torso.left else range(first, last - reach // 4)
        thickness += [n for x in inner if (n := int(np.count_nonzero(mask[:, x])))]
    return float(np.median(thickness))
