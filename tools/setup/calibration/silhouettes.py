"""Silhouettes of one person in two views compared: planes through both cameras that touch the person.

They touch both silhouettes, so that their angles about the baseline are equal (frontier points; Sinha and Pollefeys 2010,
see `zenocap.common.lags.tangents`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.tangents import NOISE_PX, WIDEST_RAD, Outline, baseline_of
from zenocap.tools.setup.calibration.parameters import LOSS_SCALE


@dataclass(frozen=True)
class Hulls:
    """Convex hulls of one camera's silhouettes in its own frame.  local: (n, k, 3), NaN where none is; cut: (n, k)."""

    local: Floats
    cut: Bools


def hulls_of(camera: Camera, outlines: Sequence[Outline | None]) -> Hulls:
    """Hulls of outlines, which are in the world of `camera`, at n instants.  Raises ValueError without any outline."""
    most = max(len(one.rays) for one in outlines if one is not None)
    local, cut = np.full((len(outlines), most, 3), np.nan), np.zeros((len(outlines), most), dtype=np.bool_)
    for k, one in enumerate(outlines):
        if one is not None:
            local[k, : len(one.rays)] = one.rays @ camera.rotation.T
            cut[k, : len(one.cut)] = one.cut
    return Hulls(local, cut)


def pair_residuals(
    cameras: Mapping[str, Camera], rays: Mapping[str, Hulls], pair: tuple[str, str], scene: Floats
) -> Floats:
    """Differences (2 n,) of both tangent angles of a pair, in standard deviations of their noise; NaN where unknown."""
    one, other = (cameras[name] for name in pair)
    baseline = baseline_of(one, other, scene)
    if baseline is None:
        return np.full(2 * len(rays[pair[0]].local), np.nan)
    ends, noises = [], []
    for name, camera in zip(pair, (one, other), strict=True):
        world = rays[name].local @ camera.rotation
        angles = np.arctan2(world @ baseline.side, world @ baseline.ahead)
        known = np.isfinite(angles)
        low, high = np.where(known, angles, np.inf).argmin(axis=1), np.where(known, angles, -np.inf).argmax(axis=1)
        rows = np.arange(len(angles))
        both = np.stack([angles[rows, low], angles[rows, high]])
        both[:, both[1] - both[0] > WIDEST_RAD] = np.nan
        both[np.stack([rays[name].cut[rows, low], rays[name].cut[rows, high]])] = np.nan
        to_scene = scene - camera.centre
        across = np.linalg.norm(np.cross(to_scene, baseline.axis)) / np.linalg.norm(to_scene)
        pixel_rad = 2.0 / float(camera.matrix[0, 0] + camera.matrix[1, 1])
        ends.append(both)
        noises.append(NOISE_PX * pixel_rad / max(0.05, float(across)))
    return np.asarray(((ends[0] - ends[1]) / np.hypot(noises[0], noises[1])).ravel())


def losses(residuals: Floats) -> Floats:
    """Cauchy loss of residuals in standard deviations."""
    return np.asarray(LOSS_SCALE**2 * np.log1p((residuals / LOSS_SCALE) ** 2))


def median_px(residuals: Floats) -> float:
    """Median distance in px of residuals in standard deviations; NaN without any."""
    known = residuals[np.isfinite(residuals)]
    return float(np.median(np.abs(known))) * 2**0.5 * NOISE_PX if len(known) else float("nan")
