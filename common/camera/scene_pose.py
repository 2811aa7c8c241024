"""Poses of a camera fitted to points of the room: start by solvePnP, refinement by least squares."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares

from zenocap.common.arrays import Floats
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError

STARTS = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8)  # focal lengths that are tried without a lens, in image widths
STEP = 1e-6  # of numeric derivatives, radians and metres
MAX_STEPS = 60  # of a refinement; what converges needs about ten; chosen by hand
COPLANAR = 1e-3  # extent of points across their plane, relative to the largest, up to which they lie in it


@dataclass(frozen=True)
class ScenePose:
    """vector: (6,) rotation vector and translation, world to camera, m; (7,) with the logarithm of the focal length."""

    size: tuple[int, int]
    lens: Lens | None
    vector: Floats

    def camera(self, name: str) -> Camera:
        """The camera, that of the rectified images for a fisheye lens."""
        lens, rotation = self.lens_in_use, np.asarray(cv2.Rodrigues(self.vector[:3])[0], dtype=np.float64)
        if lens.fisheye:
            fisheye = FisheyeLens(lens.size, lens.matrix, lens.distortions)
            return Camera(name, self.size, fisheye.pinhole_matrix(), np.zeros(4), rotation, self.vector[3:6], fisheye)
        return Camera(name, self.size, lens.matrix, lens.distortions, rotation, self.vector[3:6])

    def project(self, world: Floats) -> Floats:
        """Pixels (n, 2) of world points (n, 3) in the camera's images as they are, not rectified."""
        lens = self.lens_in_use
        local = world @ np.asarray(cv2.Rodrigues(self.vector[:3])[0]).T + self.vector[3:6]
        if lens.fisheye:
            return FisheyeLens(lens.size, lens.matrix, lens.distortions).project(local)
        image, _ = cv2.projectPoints(local, np.zeros(3), np.zeros(3), lens.matrix, lens.distortions)
        return np.asarray(image, dtype=np.float64).reshape(-1, 2)

    def in_front(self, world: Floats) -> bool:
        """Whether the camera sees all points before it."""
        depth = world @ np.asarray(cv2.Rodrigues(self.vector[:3])[0])[2] + self.vector[5]
        return bool(depth.min() > 0.0)

    def residual_px(self, world: Floats, seen: Floats) -> float:
        """Root mean square distance of pixels (n, 2) from the projected points."""
        return float(np.sqrt(((seen - self.project(world)) ** 2).sum(axis=1).mean()))

    def jacobian(self, world: Floats) -> Floats:
        """Derivatives (2 n, 6 or 7) of the pixels by the vector."""
        columns = []
        for place in range(len(self.vector)):
            step = np.zeros(len(self.vector))
            step[place] = STEP
            columns.append((self._moved(step).project(world) - self._moved(-step).project(world)).ravel() / (2 * STEP))
        return np.stack(columns, axis=1)

    def place_jacobian(self, place: Floats) -> Floats:
        """Derivatives (2, 6 or 7) by the vector of where a ray of the camera passes `place` (3,), m across the ray."""
        right = np.asarray(cv2.Rodrigues(self.vector[:3])[0])[0]
        px_per_m = np.linalg.norm(np.diff(self.project(np.stack([place, place + 0.01 * right])), axis=0)) / 0.01
        found: Floats = self.jacobian(place[None]) / px_per_m
        return found

    def _moved(self, step: Floats) -> "ScenePose":
        return replace(self, vector=self.vector + step)

    @property
    def lens_in_use(self) -> Lens:
        """The lens, or the estimated one."""
        if self.lens is not None:
            return self.lens
        focal, (width, height) = float(np.exp(self.vector[6])), self.size
        matrix = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
        return Lens("", self.size, matrix, np.zeros(4))


def fitted_poses(
    world: Floats, seen: Floats, size: tuple[int, int], lens: Lens | None, most: int | None = None
) -> list[ScenePose]:
    """Poses that fit points (n, 3), m, at pixels (n, 2), the best first; others are local minima.

    most: number of starts that are refined, those that fit best; None: all.  Raises UserError.
    """
    logs: list[float | None] = [None] if lens is not None else [float(np.log(start * size[0])) for start in STARTS]
    starts: list[ScenePose] = []
    for log in logs:
        start = ScenePose(size, lens, np.zeros(6) if log is None else np.append(np.zeros(6), log))
        starts += _starts(start, world, seen)
    if most is not None:
        starts = sorted(starts, key=lambda pose: pose.residual_px(world, seen))[:most]
    found: list[ScenePose] = []
    for pose in starts:
        refined = least_squares(
            lambda vector, pose=pose: (replace(pose, vector=vector).project(world) - seen).ravel(),
            pose.vector,
            x_scale="jac",
            max_nfev=MAX_STEPS,
        )
        fitted = replace(pose, vector=np.asarray(refined.x, dtype=np.float64))
        if fitted.in_front(world) and np.isfinite(fitted.residual_px(world, seen)):
            found.append(fitted)
    if not found:
        raise UserError("no camera sees the points at these pixels: are points exchanged?")
    return sorted(found, key=lambda pose: pose.residual_px(world, seen))


def _starts(pose: ScenePose, world: Floats, seen: Floats) -> list[ScenePose]:
    lens = pose.lens_in_use
    undistort = cv2.fisheye.undistortPoints if lens.fisheye else cv2.undistortPoints
    rays = np.asarray(undistort(seen[:, None], lens.matrix, lens.distortions), dtype=np.float64)
    extents = np.linalg.svd(world - world.mean(axis=0), compute_uv=False)
    methods = [cv2.SOLVEPNP_SQPNP, *([cv2.SOLVEPNP_IPPE] if extents[2] < COPLANAR * extents[0] else [])]
    found = []
    for method in methods:
        try:
            _, rotations, translations, _ = cv2.solvePnPGeneric(world, rays, np.eye(3), None, flags=method)
        except cv2.error:
            continue
        for rotation, translation in zip(rotations, translations, strict=True):
            found.append(replace(pose, vector=np.concatenate([rotation.ravel(), translation.ravel(), pose.vector[6:]])))
    return [one for one in found if one.in_front(world) and np.isfinite(one.project(world)).all()]
