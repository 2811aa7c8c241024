"""Precision of a calibrated rig: errors of triangulated points, claimed or true."""

from collections.abc import Sequence

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.tools.setup.calibration.bundle import READOUT, Adjusted, moved_cameras
from zenocap.tools.setup.calibration.lens_model import LensModel
from zenocap.tools.setup.calibration.rig_start import Pose

DRAWS = 40  # of the covariance
MAX_POINTS = 200


def seen_pixels(lenses: Sequence[LensModel], cameras: Sequence[Pose], points: Floats) -> Floats:
    """Pixels (cameras, n, 2) of points (n, 3) of the world; NaN outside the image."""
    found = np.full((len(cameras), len(points), 2), np.nan)
    for c, (lens, (rotation, shift)) in enumerate(zip(lenses, cameras, strict=True)):
        local = points @ rotation.T + shift
        ahead = local[:, 2] > 0
        if ahead.any():
            pixels = lens.project(local[ahead])[0]
            inside = ((pixels > -0.5) & (pixels < np.array(lens.size) - 0.5)).all(axis=1)
            found[c, np.flatnonzero(ahead)[inside]] = pixels[inside]
    return found


def triangulated(lenses: Sequence[LensModel], cameras: Sequence[Pose], pixels: Floats) -> Floats:
    """Points (n, 3) nearest to the rays of pixels (cameras, n, 2); NaN where fewer than two cameras see it."""
    count = pixels.shape[1]
    matrix, vector, rays = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros(count)
    for lens, (rotation, shift), seen in zip(lenses, cameras, pixels, strict=True):
        rows = np.flatnonzero(np.isfinite(seen[:, 0]))
        if len(rows) == 0:
            continue
        flat = lens.rays(seen[rows])
        directions = np.column_stack([flat, np.ones(len(rows))]) @ rotation
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
        matrix[rows] += across
        vector[rows] += across @ (-rotation.T @ shift)
        rays[rows] += 1
    points = np.full((count, 3), np.nan)
    good = rays >= 2
    points[good] = np.linalg.solve(matrix[good] + 1e-12 * np.eye(3), vector[good][..., None])[..., 0]
    return points


def aligned_errors(points: Floats, truth: Floats) -> Floats:
    """Distances (n,) m of points from the truth, both (n, 3), after the best rotation and shift, without scale."""
    middle, centre = points.mean(axis=0), truth.mean(axis=0)
    left, _, right = np.linalg.svd((points - middle).T @ (truth - centre))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(np.linalg.norm((points - middle) @ left @ sign @ right + centre - truth, axis=1))


def claimed_error(adjusted: Adjusted, points: Floats) -> float:
    """Expected error (rms, m) of points (n, 3) that the rig triangulates; NaN where no two cameras see them.

    Cameras are drawn from the covariances, and the worse result counts.  Their triangulations are aligned to the points:
    only the shape matters.
    """
    state = adjusted.state
    chosen = points[:: max(1, len(points) // MAX_POINTS)]
    pixels = seen_pixels(state.lenses, state.cameras, chosen)
    common = np.isfinite(pixels[..., 0]).sum(axis=0) >= 2
    if common.sum() < 4 or not len(adjusted.covariances[0]):
        return float("nan")
    return max(_drawn_error(adjusted, covariance, chosen[common], pixels[:, common]) for covariance in adjusted.covariances)


def _drawn_error(adjusted: Adjusted, covariance: Floats, points: Floats, pixels: Floats) -> float:
    state, (values, vectors) = adjusted.state, np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draw, squares = np.random.default_rng(0), []
    for _ in range(DRAWS):
        change = np.zeros(adjusted.free.shape)
        change[adjusted.free] = root @ draw.normal(size=len(values))
        moved = moved_cameras(state, change)
        found = triangulated(moved.lenses, moved.cameras, pixels)
        if np.isfinite(found).all():
            squares.append(float((aligned_errors(found, points) ** 2).mean()))
    return float(np.sqrt(np.mean(squares))) if squares else float("nan")


def focal_errors(adjusted: Adjusted) -> list[float]:
    """Relative standard deviation of each camera's focal length; 0 for a given lens."""
    by_camera = _deviations(adjusted)
    return [float(one[7] / lens.values[0]) for one, lens in zip(by_camera, adjusted.state.lenses, strict=True)]


def readout_errors(adjusted: Adjusted) -> Floats:
    """Standard deviation of each camera's time of readout, (cameras,) s; 0 where it was not estimated."""
    return np.asarray(_deviations(adjusted)[:, READOUT])


def _deviations(adjusted: Adjusted) -> Floats:
    """Standard deviations of the parameters of all cameras, (cameras, 20)."""
    deviation = np.zeros(adjusted.free.shape)
    deviation[adjusted.free] = np.sqrt(np.maximum(np.max([np.diag(one) for one in adjusted.covariances], axis=0), 0.0))
    return deviation
