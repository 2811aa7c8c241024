"""Position from two viewers' rays, and the perspective scaling factors.  [Two-view 4.2]

Level views have vertical image columns, so a column is a vertical plane: seen from above, a line through the camera.
"""

from dataclasses import dataclass

import numpy as np

from common.camera.pinhole import Camera, Floats


@dataclass(frozen=True)
class Ray:
    """A viewer's sighting: level camera, and slopes x (right) and y (down) of the ray to the navel."""

    camera: Camera
    x: float
    y: float

    def heading(self) -> Floats:
        """(2,) direction (X, Z) of the ray seen from above, of length 1 per unit of depth."""
        right, forward = self.camera.rotation[0], self.camera.rotation[2]
        return np.array([forward[0] + self.x * right[0], forward[2] + self.x * right[2]])

    def at_depth(self, depth: float) -> Floats:
        """(3,) the point of the ray at `depth` metres along the camera's axis."""
        heading = self.heading()
        centre = self.camera.centre
        return np.array([centre[0] + depth * heading[0], centre[1] - depth * self.y, centre[2] + depth * heading[1]])


def meeting_depths(first: Ray, second: Ray) -> tuple[float, float]:
    """Depths in metres at which two rays meet seen from above: Eq. 3 for any two level cameras.

    Raises ValueError when they are parallel or meet behind a camera.
    """
    a, b = first.heading(), second.heading()
    base = second.camera.centre[[0, 2]] - first.camera.centre[[0, 2]]
    cross = a[0] * b[1] - a[1] * b[0]
    if abs(cross) < 0.1 * np.linalg.norm(a) * np.linalg.norm(b):
        raise ValueError(f"rays of {first.camera.name} and {second.camera.name} are nearly parallel")
    depth_a = float((base[0] * b[1] - base[1] * b[0]) / cross)
    depth_b = float((base[0] * a[1] - base[1] * a[0]) / cross)
    if depth_a < 0.1 or depth_b < 0.1:
        raise ValueError(f"rays of {first.camera.name} and {second.camera.name} meet behind a camera")
    return depth_a, depth_b


def ground_position(x1: float, z2: float, focal1: float, focal2: float, zc1: float, xc2: float) -> tuple[float, float]:
    """(D_X, D_Z) in metres for the paper's two orthogonal cameras.  [Two-view Eq. 3, in the form that is never singular]

    x1, z2: columns from the image centre in px, x1 towards +X, z2 towards +Z.  focal: px.  zc1, xc2: camera positions, m.
    """
    # Paper: printed with x' and z' as divisors, which fails for a person on an axis.
    denominator = focal1 * focal2 + x1 * z2
    return x1 * (zc1 * focal2 + z2 * xc2) / denominator, z2 * (x1 * zc1 - xc2 * focal1) / denominator


def scaling_factor(camera: Camera, position: Floats) -> float:
    """r_t: a person's size in the image at `position` against the origin of the action region.  [Two-view Eq. 4]

    Paper: prints ratios of slant distances, exact only when the start lies on both axes; size goes with depth.
    """
    depth = float(camera.rotation[2] @ position + camera.translation[2])
    return float(camera.translation[2]) / max(depth, 1e-3)
