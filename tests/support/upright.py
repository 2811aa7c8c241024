"""Upright bodies without limbs, and their views in calibrated cameras."""

import numpy as np

from tests.support.simulated_cameras import MATRIX
from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.tools.setup.calibration.silhouettes import Hulls
from zenocap.tools.setup.calibration.walk.single_view import level_frame, up_of

HEIGHT_M, RADIUS_M = 1.7, 0.12
ANGLES = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


def figure(count: int = 60, width_m: float = 1.2) -> Floats:
    """Places (n, 2) x and z of a figure of eight, m."""
    phase = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return np.column_stack([1.6 * np.sin(phase), width_m * np.sin(2.0 * phase)])


def level_camera(tilt: float, roll: float, height_m: float, away_m: float = 5.0) -> Camera:
    """A camera on +Z that looks along -Z, tilted up and rolled, rad."""
    rotation = level_frame(up_of(tilt, roll))
    return Camera("cam01", (640, 480), MATRIX, np.zeros(5), rotation, -rotation @ np.array([0.0, height_m, away_m]))


def body(place: Floats) -> Floats:
    """Points (n, 3) of a spindle that stands at (2,) x and z: a tip on the floor, a tip at the head."""
    levels = np.linspace(0.0, 1.0, 15)
    rings = [
        np.column_stack([r * np.cos(ANGLES), np.full(len(ANGLES), HEIGHT_M * level), r * np.sin(ANGLES)])
        for level, r in zip(levels, RADIUS_M * np.sin(np.pi * levels), strict=True)
    ]
    points: Floats = np.concatenate(rings) + np.array([place[0], 0.0, place[1]])
    return points


def hulls_seen(camera: Camera, path: Floats) -> Hulls:
    """All points of the body as rays of the camera, at each place of the path (n, 2); none is cut."""
    local = np.array([body(place) @ camera.rotation.T + camera.translation for place in path])
    local /= np.linalg.norm(local, axis=2, keepdims=True)
    return Hulls(local, np.zeros(local.shape[:2], dtype=np.bool_))
