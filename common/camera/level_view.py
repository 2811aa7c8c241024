"""Level views: images of a camera rotated to zero tilt and roll, without lens distortion.

The paper's viewers look along the ground, so that the person's height is an image column.  Rotating a camera about its
centre is an exact remapping of its image.  Images of level cameras without distortion are not changed.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Floats32, Image
from zenocap.common.camera.pinhole import Camera

# All values below are chosen by hand.
MIN_OFF_VERTICAL = np.radians(10)  # smallest angle between the optical axis and the vertical
LEVEL_TOLERANCE = 1e-3  # of the elements of a rotation matrix, within which a camera is level
MIN_DEPTH = 0.3  # of border rays of unit depth in the level camera; bounds its image
MAX_SIZE = 1.5  # largest width and height of the level image relative to the real one


@dataclass(frozen=True)
class LevelView:
    """camera: level and undistorted.  real: the camera; None if both images are equal."""

    camera: Camera
    real: Camera | None

    @cached_property
    def maps(self) -> tuple[Floats32, Floats32] | None:
        """OpenCV remap tables, level to real image; None if both are equal.  Takes 0.1 s at 640x480, at the first use."""
        return None if self.real is None else _maps(self.real, self.camera)

    def warp(self, image: Image) -> Image:
        """Return the real camera's image or mask in the level view; pixels outside of the real image are 0."""
        if self.maps is None:
            return image
        nearest = cv2.INTER_NEAREST if image.ndim == 2 else cv2.INTER_LINEAR
        return np.asarray(cv2.remap(image, *self.maps, nearest), dtype=np.uint8)

    def focal_px(self) -> float:
        return float(self.camera.matrix[0, 0])

    def centre_px(self) -> tuple[float, float]:
        return float(self.camera.matrix[0, 2]), float(self.camera.matrix[1, 2])


def has_level_view(camera: Camera) -> bool:
    """Whether the camera does not point straight up or down, within MIN_OFF_VERTICAL."""
    return bool(np.hypot(camera.rotation[2, 0], camera.rotation[2, 2]) >= np.sin(MIN_OFF_VERTICAL))


def level_view(camera: Camera) -> LevelView:
    """Return the level view of a camera: same centre, same horizontal heading, same scale.

    Raises ValueError for a camera without, see `has_level_view`.
    """
    forward = camera.rotation[2]
    heading = np.array([forward[0], 0.0, forward[2]])
    if not has_level_view(camera):
        raise ValueError(f"camera {camera.name}: points within 10 degrees of straight up or down; it has no level view")
    z = heading / np.linalg.norm(heading)
    y = np.array([0.0, -1.0, 0.0])
    rotation = np.stack([np.cross(y, z), y, z])
    same_attitude = np.allclose(rotation, camera.rotation, atol=LEVEL_TOLERANCE)
    # Paper (added): 4.1 levels the cameras by hand; here every calibrated camera is levelled in software.
    if same_attitude and not np.any(camera.distortions) and np.isclose(camera.matrix[0, 0], camera.matrix[1, 1]):
        return LevelView(camera, None)
    return _turned(camera, rotation)


def _turned(camera: Camera, rotation: Floats) -> LevelView:
    width, height = camera.size
    focal = float(np.sqrt(camera.matrix[0, 0] * camera.matrix[1, 1]))
    xs, ys = np.linspace(0, width - 1, 9), np.linspace(0, height - 1, 9)
    border = np.array([(x, y) for x in xs for y in ys if x in (0, width - 1) or y in (0, height - 1)])
    rays = cv2.undistortPoints(border.reshape(-1, 1, 2), camera.matrix, camera.distortions).reshape(-1, 2)
    turned = np.column_stack([rays, np.ones(len(rays))]) @ (rotation @ camera.rotation.T).T
    seen = focal * turned[:, :2] / np.maximum(turned[:, 2:], MIN_DEPTH)
    low, high = seen.min(axis=0), seen.max(axis=0)
    # A strong tilt moves the far corners towards infinity.
    middle, half = (low + high) / 2, np.minimum((high - low) / 2, MAX_SIZE / 2 * np.array([width, height]))
    size = tuple(int(n) for n in np.ceil(2 * half))
    matrix = np.array([[focal, 0.0, half[0] - middle[0]], [0.0, focal, half[1] - middle[1]], [0.0, 0.0, 1.0]])
    level = Camera(camera.name, (size[0], size[1]), matrix, np.zeros(5), rotation, -rotation @ camera.centre)
    return LevelView(level, camera)


def _maps(camera: Camera, level: Camera) -> tuple[Floats32, Floats32]:
    """Remap tables (height, width) of the level image: x and y px in the camera's image, -1e6 outside of every image."""
    (width, height), matrix = level.size, level.matrix
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    focal = matrix[0, 0]
    rays = np.stack([(x - matrix[0, 2]) / focal, (y - matrix[1, 2]) / focal, np.ones(x.shape)], axis=-1).reshape(-1, 3)
    local = rays @ (camera.rotation @ level.rotation.T).T
    image, _ = cv2.projectPoints(local, np.zeros(3), np.zeros(3), camera.matrix, camera.distortions)
    real = image.reshape(height, width, 2).astype(np.float32)
    real[(local[:, 2] <= 0).reshape(height, width)] = -1e6
    return np.ascontiguousarray(real[..., 0]), np.ascontiguousarray(real[..., 1])
