"""Cameras for tests of the simulated person: the paper's two cameras, and arbitrary ones."""

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.rotation import rz, unit

MATRIX = np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]])


def look(name: str, centre: Floats, target: Floats, roll: float = 0.0, distortions: Floats | None = None) -> Camera:
    """A 640 x 480 camera at `centre` (3,) metres that looks at `target` (3,), rolled by `roll` radians."""
    forward = unit(target - centre)
    right = unit(np.cross(forward, [0.0, 1.0, 0.0]))
    rotation = rz(roll) @ np.stack([right, np.cross(forward, right), forward])
    lens = np.zeros(5) if distortions is None else distortions
    return Camera(name, (640, 480), MATRIX, lens, rotation, -rotation @ centre)


def paper_cameras(size: tuple[int, int] = (640, 480)) -> tuple[Camera, Camera]:
    """Camera 1 on +Z and camera 2 on -X, 1 m high and 5.2 m away."""
    middle = np.array([0.0, 1.0, 0.0])
    one = look("cam01", np.array([0.0, 1.0, 5.2]), middle)
    two = look("cam02", np.array([-5.2, 1.0, 0.0]), middle)
    return one.resized(size), two.resized(size)
