"""OpenCV's mixture of Gaussians (Zivkovic 2004) as a background model.

Unlike `Background` this is not a value: OpenCV keeps the model inside, and every labelled frame changes it.  A mixture
belongs to one viewer and sees its frames in order; the same frames in the same order give the same labels.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from common.vision.background import Image
from common.vision.foreground import BACKGROUND, STRONG, UNSURE, Labels

OPENCV_SHADOW = 127
OPENCV_FOREGROUND = 255


class Mixture:
    """A learnt mixture model.

    rate: how fast it follows the light; a person who stands still fades in 1 / rate frames.
    """

    def __init__(self, frames: Sequence[Image], rate: float = 0.0005) -> None:
        if len(frames) == 0:
            raise ValueError("background: 0 frames; at least 1 is needed")
        if not 0 <= rate < 1:
            raise ValueError(f"rate: {rate}; allowed 0 <= rate < 1")
        self._shape = frames[0].shape
        self._rate = rate
        self._model = cv2.createBackgroundSubtractorMOG2(history=len(frames), varThreshold=25, detectShadows=True)
        self._model.setShadowThreshold(0.4)
        for frame in frames:
            self._model.apply(frame)
        self._names = np.full(256, BACKGROUND, dtype=np.uint8)
        self._names[OPENCV_SHADOW], self._names[OPENCV_FOREGROUND] = UNSURE, STRONG

    def foreground(self, frame: Image) -> Labels:
        """Labels of a frame, (height, width) uint8, learning from it; ValueError for another shape."""
        if frame.shape != self._shape:
            raise ValueError(f"frame: shape {frame.shape}; the background's is {self._shape}")
        return np.asarray(cv2.LUT(self._model.apply(frame, learningRate=self._rate), self._names), dtype=np.uint8)
