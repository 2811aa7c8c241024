"""Set-up checks of one silhouette: person in view, large, clean, T-pose."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from zenocap.common.arrays import Mask
from zenocap.common.body.proportions import FRONT_SPAN, SIDE_WIDTH
from zenocap.services.animator import parameters

Verdict = Literal["good", "bad", "wait"]
Finding = tuple[str, Verdict, str]  # name of the check, verdict, and advice


@dataclass(frozen=True)
class SilhouetteShape:
    """Measures of a silhouette.  size: width, height of the image.  area: px.  box: left, top, width, height, px.

    frayed: part of the area that is thinner than three pixels.  holes: area of the holes, relative to its own.
    """

    size: tuple[int, int]
    area: int
    box: tuple[int, int, int, int]
    frayed: float
    holes: float

    @property
    def touched_edges(self) -> tuple[str, ...]:
        """Edges of the image that the silhouette touches."""
        left, top, width, height = self.box
        touched = {
            "left": left == 0, "right": left + width >= self.size[0],
            "upper": top == 0, "lower": top + height >= self.size[1],
        }  # fmt: skip
        return tuple(edge for edge, is_touched in touched.items() if is_touched)


def measure_silhouette(mask: Mask) -> SilhouetteShape:
    """Measure a mask (height, width), not 0 on the person."""
    height, width = mask.shape
    area = int(np.count_nonzero(mask))
    if not area:
        return SilhouetteShape((width, height), 0, (0, 0, 0, 0), 0.0, 0.0)
    x, y, across, down = cv2.boundingRect(mask)
    kernel = np.ones((3, 3), np.uint8)
    padded = cv2.copyMakeBorder((mask != 0).astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    frayed = area - int(np.count_nonzero(cv2.morphologyEx(padded, cv2.MORPH_OPEN, kernel)))
    contours, _ = cv2.findContours(padded, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = cv2.drawContours(np.zeros_like(padded), contours, -1, 1, cv2.FILLED)
    holes = int(np.count_nonzero(filled)) - area
    return SilhouetteShape((width, height), area, (x, y, across, down), frayed / area, holes / area)


def silhouette_findings(shape: SilhouetteShape, side: Literal["front", "side"] | None) -> list[Finding]:
    """Findings with advice for the person.  side: of the T-pose that this view shows; None: do not check the T-pose."""
    if shape.area < parameters.MIN_PERSON_AREA * shape.size[0] * shape.size[1]:
        return [("person", "wait", "step into the view")]
    return [_in_view(shape), _size(shape), _mask_quality(shape), *_posture(shape, side)]


def _in_view(shape: SilhouetteShape) -> Finding:
    if not shape.touched_edges:
        return "in view", "good", "completely in view"
    if shape.touched_edges == ("lower",):
        return "in view", "bad", "the feet are cut off: step back, or tilt the camera down"
    edges = " and ".join(shape.touched_edges)
    return "in view", "bad", f"cut off at the {edges} edge: go to the middle, or move the camera back"


def _size(shape: SilhouetteShape) -> Finding:
    height = shape.box[3] / shape.size[1]
    if height < parameters.MIN_PERSON_HEIGHT:
        return "size", "bad", f"only {height:.0%} of the image height: come closer"
    if height > parameters.MAX_PERSON_HEIGHT:
        return "size", "bad", "too close: step back"
    return "size", "good", f"{height:.0%} of the image height"


def _mask_quality(shape: SilhouetteShape) -> Finding:
    if shape.holes > parameters.MAX_HOLES:
        return "silhouette", "bad", "it has holes: clothes have the colour of the background, or the light has changed"
    if shape.frayed > parameters.MAX_FRAYED:
        return "silhouette", "bad", "its edge is frayed: more light is needed, or learn the background again"
    return "silhouette", "good", "clean"


def _posture(shape: SilhouetteShape, side: Literal["front", "side"] | None) -> list[Finding]:
    """Check the T-pose by the same limits as the viewer's measurement."""
    width_to_height = shape.box[2] / shape.box[3]
    if side == "front":
        if FRONT_SPAN[0] <= width_to_height <= FRONT_SPAN[1]:
            return [("posture", "good", "T-pose: arms stretched sideways")]
        return [("posture", "bad", "T-pose: stretch both arms sideways at shoulder height, facing this camera")]
    if side == "side":
        if width_to_height <= SIDE_WIDTH:
            return [("posture", "good", "T-pose from the side")]
        return [("posture", "bad", "T-pose: stand side-on to this camera, both arms in line with it")]
    return []
