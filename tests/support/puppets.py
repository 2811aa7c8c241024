"""Fast exact silhouettes of a walking figure of capsules, for tests with many views and frames."""

from dataclasses import dataclass

import cv2
import numpy as np

from tests.support.simulated_cameras import look
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.pinhole import Camera

CORNERS = 16


@dataclass(frozen=True)
class Capsule:
    """start, end: (3,) metres in the world.  radius: metres."""

    start: Floats
    end: Floats
    radius: float


def ring(count: int, size: tuple[int, int] = (320, 240), distance_m: float = 4.2) -> list[Camera]:
    """Cameras cam01 ... in a ring around the origin, looking at the middle of a person."""
    cameras = []
    for k in range(count):
        angle = 2 * np.pi * k / count + 0.2
        place = np.array([distance_m * np.sin(angle), 1.5 + 0.2 * (k % 2), distance_m * np.cos(angle)])
        cameras.append(look(f"cam{k + 1:02d}", place, np.array([0.0, 0.9, 0.0])).resized(size))
    return cameras


def walker(time_s: float, girth: float = 1.0) -> list[Capsule]:
    """A figure that walks in a circle, swinging its limbs; girth: factor on its radii."""
    along = 1.1 * time_s
    heading = along / 0.6
    c, s = np.cos(heading), np.sin(heading)
    to_world = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    place = np.array([-0.6 * c, 0.0, 0.6 * s])
    swing = 0.5 * np.sin(2 * np.pi * 0.9 * time_s)
    parts = [((0.0, 0.95, 0.0), (0.0, 1.35, 0.0), 0.14), ((0.0, 1.55, 0.0), (0.0, 1.65, 0.0), 0.10)]
    for side, phase in ((-1.0, swing), (1.0, -swing)):
        knee = (0.1 * side, 0.5, 0.45 * np.sin(phase))
        foot = (0.1 * side, 0.1, 0.9 * np.sin(phase) - 0.25 * max(-phase, 0.0))
        elbow = (0.26 * side, 1.1, -0.3 * np.sin(phase))
        hand = (0.30 * side, 0.95 + 0.2 * abs(phase), -0.3 * np.sin(phase) + 0.25)
        parts += [((0.09 * side, 0.9, 0.0), knee, 0.07), (knee, foot, 0.05)]
        parts += [((0.19 * side, 1.38, 0.0), elbow, 0.05), (elbow, hand, 0.04)]
    return [
        Capsule(to_world @ np.array(start) + place, to_world @ np.array(end) + place, girth * radius)
        for start, end, radius in parts
    ]


def silhouette(camera: Camera, capsules: list[Capsule]) -> Mask:
    """(height, width) 255 on the figure; a capsule is the hull of the circles where viewing lines touch its ends."""
    mask = np.zeros(camera.size[::-1], dtype=np.uint8)
    angles = np.linspace(0.0, 2 * np.pi, CORNERS, endpoint=False)[:, None]
    for capsule in capsules:
        circles = []
        for end in (capsule.start, capsule.end):
            forward = end - camera.centre
            side = np.cross(forward, [0.0, 1.0, 0.0])
            side /= np.linalg.norm(side)
            up = np.cross(side, forward) / np.linalg.norm(forward)
            circles.append(end + capsule.radius * (np.cos(angles) * side + np.sin(angles) * up))
        corners = cv2.convexHull(np.round(camera.project(np.concatenate(circles)) * 16).astype(np.int32))
        cv2.fillConvexPoly(mask, corners, 255, lineType=cv2.LINE_8, shift=4)
    return mask
