"""Pinhole cameras as OpenCV has them: x right, y down, z forward, x_camera = R x_world + t, whole-numbered centres."""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A calibrated camera in a Y-up world.

    size: (width, height) px.  matrix: (3, 3) px.  distortions: (k1, k2, p1, p2[, k3]).
    rotation: (3, 3) world to camera.  translation: (3,) metres.
    """

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortions: Floats
    rotation: Floats
    translation: Floats

    @cached_property
    def centre(self) -> Floats:
        """Position of the camera in the world, (3,) metres."""
        centre: Floats = -self.rotation.T @ self.translation
        return centre

    def project(self, points: Floats) -> Floats:
        """Pixels (n, 2) of world points (n, 3) in metres, with lens distortion; points behind the camera are NaN."""
        local = points @ self.rotation.T + self.translation
        image, _ = cv2.projectPoints(local, np.zeros(3), np.zeros(3), self.matrix, self.distortions)
        pixels: Floats = np.asarray(image, dtype=np.float64).reshape(-1, 2)
        pixels[local[:, 2] <= 0] = np.nan
        return pixels

    def resized(self, size: tuple[int, int]) -> "Camera":
        """The same camera with its image scaled to `size` (width, height)."""
        sx, sy = size[0] / self.size[0], size[1] / self.size[1]
        # Pixel centres are at integers, so the image's corner at -0.5 is the point that scaling keeps.
        scale = np.array([[sx, 0.0, 0.5 * sx - 0.5], [0.0, sy, 0.5 * sy - 0.5], [0.0, 0.0, 1.0]])
        return replace(self, size=size, matrix=scale @ self.matrix)
