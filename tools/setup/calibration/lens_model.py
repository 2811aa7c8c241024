"""Lenses as vectors of parameters, with the derivatives of their images."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera

ZERO = np.zeros(3)


@dataclass(frozen=True)
class LensModel:
    """size, guessed: as of a `Lens`.  values: fx, fy, cx, cy, and 4, 5 or 8 distortions of OpenCV, or 4 of a fisheye."""

    size: tuple[int, int]
    values: Floats
    fisheye: bool = False
    guessed: tuple[str, ...] = ()

    @classmethod
    def of(cls, lens: Lens) -> "LensModel":
        matrix = lens.matrix
        values = np.concatenate([matrix[[0, 1], [0, 1]], matrix[:2, 2], np.ravel(lens.distortions)])
        return cls(lens.size, values, lens.fisheye, lens.guessed)

    @property
    def matrix(self) -> Floats:
        """(3, 3) px."""
        fx, fy, cx, cy = self.values[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def distortions(self) -> Floats:
        return np.asarray(self.values[4:])

    @property
    def title(self) -> str:
        """The model in words."""
        return "fisheye lens" if self.fisheye else f"{len(self.distortions)} coefficients"

    def moved(self, step: Floats) -> "LensModel":
        """The lens with `step` added to its values."""
        return replace(self, values=self.values + step[: len(self.values)])

    def project(self, local: Floats) -> tuple[Floats, Floats, Floats]:
        """Pixels (n, 2) of points (n, 3) in the camera's frame; their derivatives (n, 2, 3) by the points and (n, 2, m)."""
        if self.fisheye:
            points = np.ascontiguousarray(local[:, None])
            image, slopes = cv2.fisheye.projectPoints(points, ZERO, ZERO, self.matrix, self.distortions)
            by_values, by_point = slopes[:, :8], slopes[:, 11:14]
        else:
            image, slopes = cv2.projectPoints(local, ZERO, ZERO, self.matrix, self.distortions)
            by_values, by_point = slopes[:, 6:], slopes[:, 3:6]
        count = len(local)
        pixels: Floats = np.asarray(image, dtype=np.float64).reshape(count, 2)
        by_point, by_values = (np.asarray(one, dtype=np.float64).reshape(count, 2, -1) for one in (by_point, by_values))
        return pixels, by_point, by_values

    def rays(self, pixels: Floats) -> Floats:
        """Points (n, 2) at depth 1 of pixels (n, 2)."""
        undistort = cv2.fisheye.undistortPoints if self.fisheye else cv2.undistortPoints
        found = undistort(np.ascontiguousarray(pixels[:, None]), self.matrix, self.distortions)
        return np.asarray(found, dtype=np.float64).reshape(-1, 2)

    def camera(self, name: str, rotation: Floats, translation: Floats) -> Camera:
        """The camera of this lens, that of the rectified images for a fisheye lens."""
        if self.fisheye:
            lens = FisheyeLens(self.size, self.matrix, self.distortions)
            return Camera(name, self.size, lens.pinhole_matrix(), np.zeros(4), rotation, translation, lens, self.guessed)
        return Camera(name, self.size, self.matrix, self.distortions, rotation, translation, guessed=self.guessed)


def plane_poses(lens: LensModel, corners: Floats, pixels: Floats) -> list[tuple[Floats, Floats, float]]:
    """Poses, (3, 3) and (3,), board to camera, of corners (n, 3) at pixels (n, 2), and their errors in px, best first.

    A plane seen from afar has two; one looks the other way round.
    """
    rays = lens.rays(pixels)
    if not np.isfinite(rays).all() or np.abs(rays).max() > 1e3:
        return []
    try:
        _, rotations, translations, _ = cv2.solvePnPGeneric(corners, rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return []
    found = []
    for rotation, translation in zip(rotations, translations, strict=True):
        try:
            vector, shift = cv2.solvePnPRefineLM(corners, rays, np.eye(3), None, rotation.copy(), translation.copy())
        except cv2.error:
            continue
        matrix = np.asarray(cv2.Rodrigues(vector)[0], dtype=np.float64)
        local = corners @ matrix.T + shift.ravel()
        if local[:, 2].min() > 0:
            error = float(np.sqrt(((lens.project(local)[0] - pixels) ** 2).sum(axis=1).mean()))
            if np.isfinite(error):
                found.append((matrix, np.asarray(shift, dtype=np.float64).ravel(), error))
    return sorted(found, key=lambda one: one[2])
