"""Coloured wrist bands, green right and magenta left: which arm is which, without a model file."""

from collections.abc import Callable

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image
from zenocap.common.rig.detectors import Detector

HUES = {"RWrist": (45, 75), "LWrist": (140, 165)}  # OpenCV's, 0 to 179
LEAST = 120  # saturation and value of a band, 0 to 255
CERTAIN_PX = 30  # pixels of a band from which it counts as fully visible

Box = tuple[int, int, int, int]


def loaded() -> Callable[[Image, Box], tuple[Floats, Floats]]:
    def points(image: Image, box: Box) -> tuple[Floats, Floats]:
        """Middle of each band (2, 2), px, NaN without one, and how visible it is (2,)."""
        left, top, right, bottom = box
        left, top = max(0, left), max(0, top)
        colours = cv2.cvtColor(image[top:bottom, left:right], cv2.COLOR_BGR2HSV)
        places, visible = np.full((len(HUES), 2), np.nan), np.zeros(len(HUES))
        for k, (first, last) in enumerate(HUES.values()):
            rows, columns = np.nonzero(cv2.inRange(colours, (first, LEAST, LEAST), (last, 255, 255)))
            if len(rows):
                places[k] = left + np.median(columns), top + np.median(rows)
                visible[k] = min(1.0, len(rows) / CERTAIN_PX)
        return places, visible

    return points


BANDS = Detector("bands", "points", "zenocap_bands:loaded", tuple(HUES))
