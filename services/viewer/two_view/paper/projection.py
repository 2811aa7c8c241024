"""Scaled orthographic projection, model image, and position by its shifts.  [Two-view 3.2, 4.2]"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.viewer.parameters import PAPER_ROWS, SHIFTS_PX
from zenocap.services.viewer.two_view.body_fit import BodyFit

FAR = 1e4  # depths to which the camera is moved back; a point one body height nearer is then displaced by 0.01 %


def depth_of_scale(camera: Floats, scale: float) -> float:
    """Depth of the person along the optical axis, metres, from the perspective scaling factor r_t.  [Two-view Eq. 4]

    camera: (5, 3) rows of a level view.  r_t is the image size relative to that at the origin of the action region.
    Raises ValueError for a factor of 0.
    """
    # Paper (corrected): Eq. 4 is printed with slant distances; the ratio of depths is exact everywhere.
    if scale <= 0.0:
        raise ValueError(f"scaling factor {scale:g}: allowed: above 0")
    return float(camera[3, 2]) / scale


def orthographic(camera: Floats, depth: float) -> Floats:
    """Camera rows (5, 3) whose images of points near `depth` (metres) are orthographic, at the scale of that depth.

    The camera is moved back to FAR times the depth, with a focal length longer by the same factor.  The image of a point at
    exactly `depth` is that of the real camera, and nearer points are not larger.
    """
    rows = camera.copy()
    rows[3, 2] += depth * (FAR - 1)
    rows[4, 0] *= FAR
    return rows


def point_at(camera: Floats, x: float, y: float, depth: float) -> Floats:
    """(3,) point of the world at `depth` metres on the ray of slopes x (right) and y (down)."""
    local = np.array([x, y, 1.0]) * depth - camera[3]
    point: Floats = camera[:3].T @ local
    return point


@dataclass(frozen=True)
class Shifted:
    """position: (3,) navel at the assumed depth, metres.  score: matching score there."""

    position: Floats
    score: float


def shift(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> Shifted:
    """Best of the paper's shifts along X, then of those along Y from there; leaves the fit at the result.  [Fig. 9]

    position: (3,), torso_to_world: (3, 3), directions: (4, 2, 3) of the last pose.
    """
    # Paper (corrected): 3.2 omits the shift 0, with which a good position is kept.
    # Paper (added): images of more rows than 120 are shifted by proportionally more pixels.
    pixels = max(1, round(fit.image_rows / PAPER_ROWS))
    best, score = np.array(position), fit.place(position, torso_to_world, directions)
    step = pixels * fit.metres_per_pixel()
    for axis in range(2):
        start = best
        for pixels_shifted in SHIFTS_PX:
            trial = start + pixels_shifted * step * fit.image.camera[axis]
            trial_score = fit.place(trial, torso_to_world, directions)
            if trial_score > score:
                best, score = trial, trial_score
    fit.place(best, torso_to_world, directions)
    return Shifted(best, float(score))
