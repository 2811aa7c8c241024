"""Where a picture is taken from: from a side, so that all that happens is in it, or as one of the rig's cameras."""

from collections.abc import Mapping

import numpy as np

from common.body.anatomy import Floats
from common.camera.pinhole import Camera

FIELD_OF_VIEW = np.radians(26.0)  # of the shorter side: long enough that a body is not distorted
MARGIN = 0.88  # share of the picture that is filled at most
NEAREST_M = 2.5

# Degrees from in front of somebody who faces Z towards the own left, and above the horizontal.
VIEWS: Mapping[str, tuple[float, float]] = {
    "front": (0.0, 9.0),
    "left": (90.0, 9.0),
    "back": (180.0, 9.0),
    "right": (270.0, 9.0),
    "quarter": (35.0, 14.0),
    "top": (0.0, 89.0),
}


def looking(azimuth: float, elevation: float, points: Floats, size: tuple[int, int], turned: bool = False) -> Camera:
    """A camera so far away that all of `points` (n, 3), metres, are well within its image.

    azimuth, elevation: of the camera as seen from the points, radians, from +Z towards +X and up.
    turned: the camera will go round them, so that they are to fit from everywhere.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    target = 0.5 * (low + high)
    back = np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
    right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
    up = np.cross(back, right)
    half = np.tan(FIELD_OF_VIEW / 2) * np.array(size) / min(size)  # tangents across and up
    away = points - target
    if turned:
        reach = np.hypot(away[:, 0], away[:, 2])
        away = np.concatenate([np.stack([reach * s, away[:, 1], reach * c], axis=1) for s, c in _circle()])
    wanted = np.abs(np.stack([away @ right, away @ up], axis=1)) / (MARGIN * half)
    distance = max(float(np.max(wanted.max(axis=1) + away @ back)), NEAREST_M)
    return _camera(target + distance * back, right, up, back, size)


def focused(camera: Camera, size: tuple[int, int]) -> Camera:
    """One of the rig's cameras without its lens's distortion, in a picture of another size that shows at least the same."""
    scale = min(size[0] / camera.size[0], size[1] / camera.size[1])
    focal = 0.5 * (camera.matrix[0, 0] + camera.matrix[1, 1]) * scale
    offset = (camera.matrix[:2, 2] - (np.array(camera.size) - 1) / 2) * scale
    centre = (np.array(size) - 1) / 2 + offset
    matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    return Camera(camera.name, size, matrix, np.zeros(4), camera.rotation, camera.translation)


def moved(camera: Camera, by: Floats) -> Camera:
    """The same camera elsewhere; by: (3,) metres."""
    return Camera(
        camera.name, camera.size, camera.matrix, camera.distortions, camera.rotation,
        camera.translation - camera.rotation @ by,
    )  # fmt: skip


def orbited(camera: Camera, middle: Floats, turn: float) -> Camera:
    """The same camera gone round a vertical line through `middle` (3,), counter-clockwise as seen from above, radians."""
    c, s = np.cos(turn), np.sin(turn)
    round_about = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    rotation = camera.rotation @ round_about.T
    centre = middle + round_about @ (camera.centre - middle)
    return Camera(camera.name, camera.size, camera.matrix, camera.distortions, rotation, -rotation @ centre)


def _circle() -> list[tuple[float, float]]:
    turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    return list(zip(np.sin(turns).tolist(), np.cos(turns).tolist(), strict=True))


def _camera(centre: Floats, right: Floats, up: Floats, back: Floats, size: tuple[int, int]) -> Camera:
    rotation = np.stack([right, -up, -back])
    focal = min(size) / 2 / np.tan(FIELD_OF_VIEW / 2)
    matrix = np.array([[focal, 0.0, (size[0] - 1) / 2], [0.0, focal, (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera("picture", size, matrix, np.zeros(4), rotation, -rotation @ centre)
