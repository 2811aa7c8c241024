"""Fisheye lenses, and the pinhole camera of an image that is rectified once, where it is read.

OpenCV's fisheye model (Kannala and Brandt 2006): a ray at the angle θ from the optical axis is seen at the distance
θ_d = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) from the principal point, in focal lengths.  A pinhole has tan θ, which has no
end at 90 degrees: only rays within MAX_ANGLE of the axis are kept.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from zenocap.common.arrays import Floats, Image

MAX_ANGLE = np.radians(60.0)  # of kept rays from the axis, along the sides; at 60 degrees tan θ is 1.7 θ; chosen by hand
STEPS = 240  # of the table of θ_d, a quarter of a degree each


def scaled_matrix(matrix: Floats, old: tuple[int, int], new: tuple[int, int]) -> Floats:
    """Camera matrix (3, 3) px of images scaled to another size (width, height): their corner stays at -0.5."""
    sx, sy = new[0] / old[0], new[1] / old[1]
    return np.array([[sx, 0.0, 0.5 * sx - 0.5], [0.0, sy, 0.5 * sy - 0.5], [0.0, 0.0, 1.0]]) @ matrix


@dataclass(frozen=True)
class FisheyeLens:
    """size: (width, height) of the lens' images, px.  matrix: (3, 3) px.  coefficients: (k1, k2, k3, k4)."""

    size: tuple[int, int]
    matrix: Floats
    coefficients: Floats

    def distance(self, angle: Floats) -> Floats:
        """Distance θ_d from the principal point of rays at `angle` (radians) from the axis, in focal lengths."""
        powers = np.asarray(angle, dtype=np.float64)[..., None] ** np.arange(1, 10, 2)
        found: Floats = powers @ np.concatenate([[1.0], self.coefficients])
        return found

    @property
    def increases(self) -> bool:
        """Whether θ_d increases with θ for all kept rays: otherwise the lens would show some of them twice."""
        return bool(np.all(np.diff(self.distance(np.linspace(0.0, MAX_ANGLE, STEPS + 1))) > 0.0))

    def project(self, rays: Floats) -> Floats:
        """Pixels (n, 2) of rays (n, 3) in the camera's frame; NaN behind the camera."""
        radius = np.hypot(rays[:, 0], rays[:, 1])
        angle = np.arctan2(radius, rays[:, 2])
        scale = np.divide(self.distance(angle), radius, out=np.ones_like(radius), where=radius > 0)
        pixels: Floats = (rays[:, :2] * scale[:, None]) * self.matrix[[0, 1], [0, 1]] + self.matrix[:2, 2]
        pixels[rays[:, 2] <= 0] = np.nan
        return pixels

    def pinhole_matrix(self) -> Floats:
        """Matrix (3, 3) px of the rectified image of the same size.

        Square pixels, the lens' principal point, and the smallest focal length at which each side shows no more than the
        lens does, and no more than MAX_ANGLE.  The rectified image has no empty border.
        """
        angles = np.linspace(0.0, MAX_ANGLE, STEPS + 1)
        distances = self.distance(angles)
        focal = 0.0
        for axis in (0, 1):
            centre = float(self.matrix[axis, 2])
            for side in (centre + 0.5, self.size[axis] - 0.5 - centre):
                if side > 0.0:
                    angle = np.interp(side / self.matrix[axis, axis], distances, angles)
                    focal = max(focal, side / float(np.tan(angle)))
        return np.array([[focal, 0.0, self.matrix[0, 2]], [0.0, focal, self.matrix[1, 2]], [0.0, 0.0, 1.0]])

    def resized(self, size: tuple[int, int]) -> "FisheyeLens":
        """The lens with its image scaled to `size` (width, height)."""
        return replace(self, size=size, matrix=scaled_matrix(self.matrix, self.size, size))

    def rectification(self, matrix: Floats, size: tuple[int, int]) -> Callable[[Image], Image]:
        """Function that turns this lens' images, scaled to `size`, into those of a pinhole of `matrix` and `size`."""
        lens, (width, height) = self.resized(size), size
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1).reshape(-1, 3)
        seen = lens.project(pixels @ np.linalg.inv(matrix).T).astype(np.float32).reshape(height, width, 2)
        coarse, fine = cv2.convertMaps(seen[..., 0], seen[..., 1], cv2.CV_16SC2)

        def rectify(image: Image) -> Image:
            found = cv2.remap(image, coarse, fine, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            return np.asarray(found, dtype=np.uint8)

        return rectify
