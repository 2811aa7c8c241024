"""Pictures of a simulated room with marks at known points."""

from collections.abc import Mapping

import cv2
import numpy as np

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Image
from zenocap.common.camera.pinhole import Camera

ROOM = {
    "corner": (0.0, 0.0, 0.0), "mark": (0.0, 0.0, 1.5), "door": (1.5, 0.0, 0.2), "pole": (1.4, 1.2, -1.3),
    "lamp": (-1.5, 1.9, 1.0), "shelf": (0.3, 1.8, -1.5), "box": (-1.2, 0.6, -0.4), "edge": (-1.4, 0.0, 0.9),
}  # fmt: skip
"""X, Y and Z of the points, m."""


def room_camera(name: str, angle: float) -> Camera:
    """A 640 x 480 camera 6 m away from the middle of the room, `angle` radians from +Z."""
    centre = np.array([6.0 * np.sin(angle), 1.7, 6.0 * np.cos(angle)])
    return look(name, centre, np.array([0.0, 0.8, 0.0]))


def marked_picture(camera: Camera, points: Mapping[str, tuple[float, float, float]] = ROOM) -> Image:
    """A picture with a white cross at every point."""
    width, height = camera.size
    image = np.full((height, width, 3), (70, 60, 50), dtype=np.uint8)
    for place in points.values():
        x, y = np.rint(camera.project(np.array([place]))[0]).astype(int)
        cv2.drawMarker(image, (int(x), int(y)), (255, 255, 255), cv2.MARKER_CROSS, 13, 1)
    return image
