"""Mixture of Gaussians of OpenCV (Zivkovic 2004) as a background model.

Unlike `Background` it is mutable: every labelled frame changes the model inside OpenCV.  A mixture belongs to one viewer
and receives its frames in order; the same frames in the same order give the same labels.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from zenocap.common.arrays import Image, Labels
from zenocap.common.vision.foreground import BACKGROUND, STRONG, UNSURE

OPENCV_SHADOW = 127
OPENCV_FOREGROUND = 255


# Paper (replaced): [Hybrid III] has a mixture for every silhouette; here it is one choice, `background = "mog2"`.
class Mixture:
    """A learnt mixture model.

    rate: learning rate per frame; a person standing still becomes background within 1 / rate frames.  Chosen by hand.
    noise: grey levels, for others: the model has none of its own.  room: None, OpenCV gives no access to its model.
    """

    room = None

    def __init__(self, frames: Sequence[Image], rate: float = 0.0005, noise: float = 2.0) -> None:
        if len(frames) == 0:
            raise ValueError("background: 0 frames; at least 1 is needed")
        if not 0 <= rate < 1:
            raise ValueError(f"rate: {rate}; allowed 0 <= rate < 1")
        self._shape = frames[0].shape
        self._rate, self.noise = rate, noise
        self._model = cv2.createBackgroundSubtractorMOG2(history=len(frames), varThreshold=25, detectShadows=True)
        self._model.setShadowThreshold(0.4)
        for frame in frames:
            self._model.apply(frame)
        self._names = np.full(256, BACKGROUND, dtype=np.uint8)
        self._names[OPENCV_SHADOW], self._names[OPENCV_FOREGROUND] = UNSURE, STRONG

    def foreground(self, frame: Image) -> Labels:
        """Labels of a frame, (height, width); learns from it.  Raises ValueError for another shape."""
        if frame.shape != self._shape:
            raise ValueError(f"frame: shape {frame.shape}; the background's is {self._shape}")
        return np.asarray(cv2.LUT(self._model.apply(frame, learningRate=self._rate), self._names), dtype=np.uint8)
