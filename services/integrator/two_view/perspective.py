"""Position from the rays of two viewers, and the perspective scaling factors.  [Two-view 4.2]

A column of a level view is a vertical plane, which appears as a line through the camera in the ground plane.
"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.services.integrator.parameters import ORTHOGONAL_COS

NEAREST_M = 0.1  # depth of a person before a camera, metres; chosen by hand


@dataclass(frozen=True)
class Ray:
    """Ray of a sighting: level camera, and slopes x (right) and y (down) of the ray to the navel."""

    camera: Camera
    x: float
    y: float

    def heading(self) -> Floats:
        """(2,) direction (X, Z) of the ray in the ground plane per metre of depth."""
        right, forward = self.camera.rotation[0], self.camera.rotation[2]
        return np.array([forward[0] + self.x * right[0], forward[2] + self.x * right[2]])

    def at_depth(self, depth: float) -> Floats:
        """(3,) point of the ray at `depth` metres along the optical axis."""
        heading = self.heading()
        centre = self.camera.centre
        return np.array([centre[0] + depth * heading[0], centre[1] - depth * self.y, centre[2] + depth * heading[1]])


def intersection_depths(first: Ray, second: Ray) -> tuple[float, float]:
    """Depths in metres at which two rays intersect in the ground plane: [Two-view Eq. 3] for any two level cameras.

    Raises ValueError when they are parallel or intersect behind a camera.
    """
    a, b = first.heading(), second.heading()
    base = second.camera.centre[[0, 2]] - first.camera.centre[[0, 2]]
    cross = a[0] * b[1] - a[1] * b[0]
    if abs(cross) < 0.1 * np.linalg.norm(a) * np.linalg.norm(b):
        raise ValueError(f"rays of {first.camera.name} and {second.camera.name} are nearly parallel")
    depth_a = float((base[0] * b[1] - base[1] * b[0]) / cross)
    depth_b = float((base[0] * a[1] - base[1] * a[0]) / cross)
    if depth_a < NEAREST_M or depth_b < NEAREST_M:
        raise ValueError(f"rays of {first.camera.name} and {second.camera.name} intersect behind a camera")
    return depth_a, depth_b


def ground_position(x1: float, z2: float, focal1: float, focal2: float, zc1: float, xc2: float) -> tuple[float, float]:
    """(D_X, D_Z) in metres for two orthogonal cameras.  [Two-view Eq. 3]

    x1, z2: columns from the image centre in px, x1 towards +X, z2 towards +Z.  focal: px.  zc1, xc2: camera positions, m.
    """
    # Paper (corrected): Eq. 3 divides by x' and z', singular for a person on an axis; this form is equal elsewhere.
    denominator = focal1 * focal2 + x1 * z2
    return x1 * (zc1 * focal2 + z2 * xc2) / denominator, z2 * (x1 * zc1 - xc2 * focal1) / denominator


def position_of(facade: Ray, flank: Ray) -> Floats:
    """(3,) navel: X and Z by Eq. 3, Y of the facade viewer.  [Two-view 3.2, 4.2, 4.4]

    Raises ValueError as `intersection_depths`.
    """
    along_z, along_x = -facade.camera.rotation[2], flank.camera.rotation[2]  # +Z and +X of the action region
    if abs(along_z @ along_x) > ORTHOGONAL_COS:
        # Paper (added): 4.1 adjusts the cameras until they are orthogonal; for others, the intersection of the rays.
        return facade.at_depth(intersection_depths(facade, flank)[0])
    one, two = facade.camera.centre, flank.camera.centre
    base = two - one
    centre = one + (base @ along_z) * along_z  # both optical axes meet here, in the ground plane
    focal1, focal2 = float(facade.camera.matrix[0, 0]), float(flank.camera.matrix[0, 0])
    x1 = focal1 * facade.x * float(np.sign(facade.camera.rotation[0] @ along_x))
    z2 = focal2 * flank.x * float(np.sign(flank.camera.rotation[0] @ along_z))
    zc1, xc2 = float((one - centre) @ along_z), float((two - centre) @ along_x)
    right, forward = ground_position(x1, z2, focal1, focal2, zc1, xc2)
    depth = zc1 - forward
    if depth < NEAREST_M or right - xc2 < NEAREST_M:
        raise ValueError(f"rays of {facade.camera.name} and {flank.camera.name} intersect behind a camera")
    point = centre + right * along_x + forward * along_z
    return np.array([point[0], facade.at_depth(depth)[1], point[2]])


def scaling_factor(camera: Camera, position: Floats) -> float:
    """r_t: image size of a person at `position` relative to the origin of the action region.  [Two-view Eq. 4]"""
    # Paper (corrected): Eq. 4 prints slant distances, exact only for a start on both axes; here the ratio of depths.
    depth = float(camera.rotation[2] @ position + camera.translation[2])
    return float(camera.translation[2]) / max(depth, 1e-3)
