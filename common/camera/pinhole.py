"""Pinhole cameras, their attitude, and the most orthogonal pair of several.

OpenCV's convention: x right, y down, z forward, x_camera = R x_world + t, pixel centres at integers.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.fisheye import FisheyeLens, scaled_matrix

SMALL_TURN = 1e-3  # rad, below which the series of `rodrigues` is exact to rounding


@dataclass(frozen=True)
class Camera:
    """A calibrated camera in a Y-up world.

    size: (width, height) px.  matrix: (3, 3) px.  distortions: (k1, k2, p1, p2[, k3]).
    rotation: (3, 3) world to camera.  translation: (3,) metres.
    fisheye: lens of the images before they were rectified to this camera; None for images that are used as they are.
    guessed: names in `validation.GUESSES`, of what the program that wrote the calibration did not know.
    """

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortions: Floats
    rotation: Floats
    translation: Floats
    fisheye: FisheyeLens | None = None
    guessed: tuple[str, ...] = ()

    @cached_property
    def centre(self) -> Floats:
        """Position of the camera in the world, (3,) metres."""
        centre: Floats = -self.rotation.T @ self.translation
        return centre

    def project(self, points: Floats) -> Floats:
        """Project world points (n, 3), metres, to pixels (n, 2) with lens distortion; NaN for points behind the camera."""
        local = points @ self.rotation.T + self.translation
        image, _ = cv2.projectPoints(local, np.zeros(3), np.zeros(3), self.matrix, self.distortions)
        pixels: Floats = np.asarray(image, dtype=np.float64).reshape(-1, 2)
        pixels[local[:, 2] <= 0] = np.nan
        return pixels

    def resized(self, size: tuple[int, int]) -> "Camera":
        """Return the camera with its image scaled to `size` (width, height)."""
        return replace(self, size=size, matrix=scaled_matrix(self.matrix, self.size, size))


SAME_DEG = 2.0  # pairs whose deviations from 90° differ by less are equal, the front view decides; chosen by hand


@dataclass(frozen=True)
class Attitude:
    """heading_deg: from -Z (the paper's camera 1) towards +X.  tilt_deg: upwards.  roll_deg: clockwise in the image."""

    heading_deg: float
    tilt_deg: float
    roll_deg: float


def attitude(camera: Camera) -> Attitude:
    """Heading, tilt and roll of a camera; the heading of a camera that points straight up or down is 0."""
    right, down, forward = camera.rotation
    heading = np.arctan2(forward[0], -forward[2])
    tilt = np.arctan2(forward[1], np.hypot(forward[0], forward[2]))
    roll = np.arctan2(right[1], -down[1])
    return Attitude(*(float(np.degrees(angle)) for angle in (heading, tilt, roll)))


def angle_between_deg(one: Camera, other: Camera) -> float:
    """Angle between the headings of two cameras, 0 to 180 degrees."""
    difference = abs(attitude(one).heading_deg - attitude(other).heading_deg) % 360.0
    return min(difference, 360.0 - difference)


def most_orthogonal_pair(cameras: dict[str, Camera]) -> tuple[str, str]:
    """Names of the two cameras whose headings are nearest to 90 degrees apart; the one nearest to heading 0 first.

    Of pairs within 2 degrees of the best, the one with the camera nearest to heading 0; then the first by order.
    Raises ValueError for fewer than two cameras.
    """
    if len(cameras) < 2:
        raise ValueError(f"two cameras are needed for a pair; there are: {', '.join(cameras) or 'none'}")
    deviation = {
        pair: abs(90.0 - angle_between_deg(*(cameras[name] for name in pair))) for pair in combinations(cameras, 2)
    }
    best = min(deviation.values())
    front = {name: abs(attitude(camera).heading_deg) for name, camera in cameras.items()}
    candidates = [pair for pair in deviation if deviation[pair] <= best + SAME_DEG]
    pair = min(candidates, key=lambda names: min(round(front[name], 6) for name in names))
    first, second = sorted(pair, key=lambda name: round(front[name], 6))
    return first, second


def rodrigues(rotation: Floats) -> Floats:
    """(3,) rotation vector in radians of a matrix (3, 3).

    OpenCV's conversion returns 0 for turns below 1e-5 rad.  For small ones the antisymmetric part is used: it is the sine
    of the angle along the axis: v = s + |s|^2 s / 6, exact to |s|^5.
    """
    sine = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    square = float(sine @ sine)
    if square < SMALL_TURN**2 and np.trace(rotation) > 0.0:  # not near half a turn
        return np.asarray(sine * (1.0 + square / 6.0))
    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).reshape(3)
