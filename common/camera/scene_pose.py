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
class Picks:
    """Points of the room, and where a camera's images show them.

    world: (n, 3) m.  seen: (n, 2) px.  size: (width, height) of the images, px.  lens: None: one to be estimated.
    """

    world: Floats
    seen: Floats
    size: tuple[int, int]
    lens: Lens | None


@dataclass(frozen=True)
class ScenePose:
    """vector: (6,) rotation vector and translation, world to camera, m; (7,) with the logarithm of the focal length."""

    size: tuple[int, int]
    lens: Lens | None
    vector: Floats

    def camera(self, name: str) -> Camera:
        """The camera, that of the rectified images for a fisheye lens."""
        lens = self.lens_in_use
        fisheye = FisheyeLens(lens.size, lens.matrix, lens.distortions) if lens.fisheye else None
        matrix, distortions = (fisheye.pinhole_matrix(), np.zeros(4)) if fisheye else (lens.matrix, lens.distortions)
        return Camera(name, self.size, matrix, distortions, self.rotation, self.vector[3:6], fisheye, lens.guessed)

    @property
    def rotation(self) -> Floats:
        """(3, 3) world to camera."""
        return np.asarray(cv2.Rodrigues(self.vector[:3])[0], dtype=np.float64)

    def project(self, world: Floats) -> Floats:
        """Pixels (n, 2) of world points (n, 3) in the camera's images as they are, not rectified."""
        lens = self.lens_in_use
        local = world @ self.rotation.T + self.vector[3:6]
        if lens.fisheye:
            return FisheyeLens(lens.size, lens.matrix, lens.distortions).project(local)
        image, _ = cv2.projectPoints(local, np.zeros(3), np.zeros(3), lens.matrix, lens.distortions)
        return np.asarray(image, dtype=np.float64).reshape(-1, 2)

    def in_front(self, world: Floats) -> bool:
        """Whether the camera sees all points before it."""
        return bool((world @ self.rotation[2] + self.vector[5]).min() > 0.0)

    def residual_px(self, picks: Picks) -> float:
        """Root mean square distance of the pixels from the projected points."""
        return float(np.sqrt(((picks.seen - self.project(picks.world)) ** 2).sum(axis=1).mean()))

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
        moved = np.stack([place, place + 0.01 * self.rotation[0]])
        px_per_m = np.linalg.norm(np.diff(self.project(moved), axis=0)) / 0.01
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


def fitted_poses(picks: Picks, most: int | None = None) -> list[ScenePose]:
    """Poses that fit, the best first; others are local minima.

    most: number of starts that are refined, those that fit best; None: all.  Raises UserError.
    """
    world, seen = picks.world, picks.seen
    logs = [[]] if picks.lens is not None else [[np.log(start * picks.size[0])] for start in STARTS]
    starts = [one for log in logs for one in _starts(ScenePose(picks.size, picks.lens, np.array([0.0] * 6 + log)), picks)]
    if most is not None:
        starts = sorted(starts, key=lambda pose: pose.residual_px(picks))[:most]
    found: list[ScenePose] = []
    for pose in starts:
        refined = least_squares(
            lambda vector, pose=pose: (replace(pose, vector=vector).project(world) - seen).ravel(),
            pose.vector, x_scale="jac", max_nfev=MAX_STEPS,
        )  # fmt: skip
        fitted = replace(pose, vector=np.asarray(refined.x, dtype=np.float64))
        if fitted.in_front(world) and np.isfinite(fitted.residual_px(picks)):
            found.append(fitted)
    if not found:
        raise UserError("no camera sees the points at these pixels: are points exchanged?")
    return sorted(found, key=lambda pose: pose.residual_px(picks))


def _starts(pose: ScenePose, picks: Picks) -> list[ScenePose]:
    lens, world = pose.lens_in_use, picks.world
    undistort = cv2.fisheye.undistortPoints if lens.fisheye else cv2.undistortPoints
    rays = np.asarray(undistort(picks.seen[:, None], lens.matrix, lens.distortions), dtype=np.float64)
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
