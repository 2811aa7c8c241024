"""A level view: the image a camera would give without tilt, roll and lens distortion.

The paper's viewers look along the ground, so that the person's height is an image column.  A real camera is turned to
that attitude about its own centre, which is an exact remapping of its image; level cameras pass through unchanged.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from common.camera.pinhole import Camera, Floats

Mask = NDArray[np.uint8]


@dataclass(frozen=True)
class LevelView:
    """camera: the level, undistorted camera.  maps: OpenCV remap tables, level to real image; None where both agree."""

    camera: Camera
    maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None

    def warp(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The real camera's image or mask as the level view sees it; what the real camera does not see is 0."""
        if self.maps is None:
            return image
        nearest = cv2.INTER_NEAREST if image.ndim == 2 else cv2.INTER_LINEAR
        return np.asarray(cv2.remap(image, *self.maps, nearest), dtype=np.uint8)

    def focal_px(self) -> float:
        return float(self.camera.matrix[0, 0])

    def centre_px(self) -> tuple[float, float]:
        return float(self.camera.matrix[0, 2]), float(self.camera.matrix[1, 2])


def level_view(camera: Camera) -> LevelView:
    """The level view of a camera: same centre, same horizontal heading, same scale.

    Raises ValueError when the camera looks straight up or down, where no horizontal heading exists.
    """
    forward = camera.rotation[2]
    heading = np.array([forward[0], 0.0, forward[2]])
    if np.linalg.norm(heading) < np.sin(np.radians(10)):
        raise ValueError(f"camera {camera.name}: looks within 10 degrees of straight up or down; no level view exists")
    z = heading / np.linalg.norm(heading)
    y = np.array([0.0, -1.0, 0.0])
    rotation = np.stack([np.cross(y, z), y, z])
    same_attitude = np.allclose(rotation, camera.rotation, atol=1e-3)
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
    seen = focal * turned[:, :2] / np.maximum(turned[:, 2:], 0.3)
    low, high = seen.min(axis=0), seen.max(axis=0)
    # A strong tilt stretches the far corners without end; half as much again as the real image is kept.
    middle, half = (low + high) / 2, np.minimum((high - low) / 2, 0.75 * np.array([width, height]))
    size = tuple(int(n) for n in np.ceil(2 * half))
    matrix = np.array([[focal, 0.0, half[0] - middle[0]], [0.0, focal, half[1] - middle[1]], [0.0, 0.0, 1.0]])
    level = Camera(camera.name, (size[0], size[1]), matrix, np.zeros(5), rotation, -rotation @ camera.centre)
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    rays = np.stack([(x - matrix[0, 2]) / focal, (y - matrix[1, 2]) / focal, np.ones(x.shape)], axis=-1).reshape(-1, 3)
    local = rays @ (camera.rotation @ rotation.T).T
    image, _ = cv2.projectPoints(local, np.zeros(3), np.zeros(3), camera.matrix, camera.distortions)
    real = image.reshape(size[1], size[0], 2).astype(np.float32)
    real[(local[:, 2] <= 0).reshape(size[1], size[0])] = -1e6
    return LevelView(level, (np.ascontiguousarray(real[..., 0]), np.ascontiguousarray(real[..., 1])))
