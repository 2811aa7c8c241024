"""What to put right before a body is measured, told from one silhouette: is the person whole, large, clean, well posed?"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from common.body.proportions import FRONT_SPAN, SIDE_WIDTH

Mask = NDArray[np.uint8]
Verdict = Literal["good", "bad", "wait"]
Finding = tuple[str, Verdict, str]  # what is looked at, how it is, and what to do about it

LEAST_HEIGHT, MOST_HEIGHT = 0.35, 0.97  # of the picture
LEAST_PERSON = 0.004  # of the picture: less is nobody
MOST_FRAYED = 0.12  # share of a silhouette that is thinner than three pixels
MOST_HOLES = 0.02  # share of it that is holes


@dataclass(frozen=True)
class Shape:
    """Of a silhouette.  box: left, top, width, height, px.  frayed, holes: shares of its area."""

    size: tuple[int, int]
    area: int
    box: tuple[int, int, int, int]
    frayed: float
    holes: float

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides of the picture that the silhouette touches."""
        left, top, width, height = self.box
        touched = {
            "left": left == 0, "right": left + width >= self.size[0],
            "upper": top == 0, "lower": top + height >= self.size[1],
        }  # fmt: skip
        return tuple(side for side, is_touched in touched.items() if is_touched)


def shape_of(mask: Mask) -> Shape:
    """mask: (height, width), not 0 on the person."""
    height, width = mask.shape
    area = int(np.count_nonzero(mask))
    if not area:
        return Shape((width, height), 0, (0, 0, 0, 0), 0.0, 0.0)
    x, y, across, down = cv2.boundingRect(mask)
    kernel = np.ones((3, 3), np.uint8)
    padded = cv2.copyMakeBorder((mask != 0).astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    frayed = area - int(np.count_nonzero(cv2.morphologyEx(padded, cv2.MORPH_OPEN, kernel)))
    contours, _ = cv2.findContours(padded, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = cv2.drawContours(np.zeros_like(padded), contours, -1, 1, cv2.FILLED)
    holes = int(np.count_nonzero(filled)) - area
    return Shape((width, height), area, (x, y, across, down), frayed / area, holes / area)


def findings(shape: Shape, seen_as: Literal["front", "side"] | None) -> list[Finding]:
    """What a person can read and act on.  seen_as: the side of the initial posture that this view is for, if known."""
    if shape.area < LEAST_PERSON * shape.size[0] * shape.size[1]:
        return [("person", "wait", "step into the view")]
    return [_whole(shape), _large(shape), _clean(shape), *_posture(shape, seen_as)]


def _whole(shape: Shape) -> Finding:
    if not shape.sides:
        return "in view", "good", "wholly in view"
    if shape.sides == ("lower",):
        return "in view", "bad", "the feet are cut: step back, or tilt the camera down"
    return "in view", "bad", f"cut at the {' and '.join(shape.sides)} edge: go to the middle, or move the camera back"


def _large(shape: Shape) -> Finding:
    share = shape.box[3] / shape.size[1]
    if share < LEAST_HEIGHT:
        return "size", "bad", f"only {share:.0%} of the picture's height: come closer"
    if share > MOST_HEIGHT:
        return "size", "bad", "too close: step back"
    return "size", "good", f"{share:.0%} of the picture's height"


def _clean(shape: Shape) -> Finding:
    if shape.holes > MOST_HOLES:
        return "silhouette", "bad", "it has holes: clothes are coloured like the background, or light has changed"
    if shape.frayed > MOST_FRAYED:
        return "silhouette", "bad", "its edge is frayed: more light, or learn the background again"
    return "silhouette", "good", "clean"


def _posture(shape: Shape, seen_as: Literal["front", "side"] | None) -> list[Finding]:
    """The same limits by which a viewer measures."""
    share = shape.box[2] / shape.box[3]
    if seen_as == "front":
        if FRONT_SPAN[0] <= share <= FRONT_SPAN[1]:
            return [("posture", "good", "arms stretched sideways")]
        return [("posture", "bad", "stretch both arms sideways, at the height of the shoulders, facing this camera")]
    if seen_as == "side":
        if share <= SIDE_WIDTH:
            return [("posture", "good", "side on")]
        return [("posture", "bad", "stand side on to this camera, arms in line with it")]
    return []
