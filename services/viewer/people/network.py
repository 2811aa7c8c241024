"""The network: probability of a person for every pixel of a square picture."""

from collections.abc import Callable
from typing import cast

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image
from zenocap.common.rig.detectors import DETECTORS

INPUT_PX = 256  # side of the picture that the model takes

Find = Callable[[Image], Floats32]
"""A picture (side, side, 3) uint8 BGR to the probabilities of a person, (side, side) in [0, 1]."""


def load_network() -> Find:
    """The network of the detector `people`, for one thread at a time.  Raises UserError without its model file."""
    return cast("Find", DETECTORS.row("people").loaded())


def loaded(model: bytes) -> Find:
    """The network of a model file."""
    network = cv2.dnn.readNetFromTFLite(np.frombuffer(model, dtype=np.uint8))

    def find(picture: Image) -> Floats32:
        side = picture.shape[0]
        way = cv2.INTER_AREA if side > INPUT_PX else cv2.INTER_LINEAR
        small = cv2.resize(picture, (INPUT_PX, INPUT_PX), interpolation=way)
        network.setInput(cv2.dnn.blobFromImage(small, 1.0 / 255.0, swapRB=True))
        found = np.asarray(network.forward(), dtype=np.float32).reshape(INPUT_PX, INPUT_PX)
        return np.asarray(cv2.resize(found, (side, side), interpolation=cv2.INTER_LINEAR), dtype=np.float32)

    return find
