"""Moved cameras of a calibrated rig, from silhouettes.

The planes through the centres of two cameras that touch the person touch both silhouettes, so that their angles about the
baseline are equal (Sinha and Pollefeys 2010, see `zenocap.common.lags.tangents`).  After a camera was moved, the angles of
all its pairs differ, those of the other pairs do not.  For each camera the motion is fitted that makes its pairs agree; the
one that explains most was moved.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from scipy.optimize import least_squares

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import jackknife_error
from zenocap.common.lags.tangents import Outline, scene_centre
from zenocap.tools.setup.calibration import parameters as p
from zenocap.tools.setup.calibration.silhouettes import Hulls, hulls_of, losses, median_px, pair_residuals


@dataclass(frozen=True)
class MovedCamera:
    """turn_deg: its turn.  shift_m: movement of its centre.  apart_px: offset of the person from the old place.

    Errors: standard errors, of a jackknife.  before_px, after_px: median distance of its silhouettes from where the other
    cameras put their borders, before and with the new pose.  camera: its present pose.
    """

    name: str
    turn_deg: float
    turn_error_deg: float
    shift_m: float
    shift_error_m: float
    apart_px: float
    error_px: float
    before_px: float
    after_px: float
    camera: Camera


@dataclass(frozen=True)
class Drift:
    """moved: in the order in which they were found.  pairs_px: median disagreement of each compared pair as calibrated, px.

    unchecked: cameras without a compared pair.  instants: number of compared instants.
    """

    moved: tuple[MovedCamera, ...]
    pairs_px: Mapping[tuple[str, str], float]
    unchecked: tuple[str, ...]
    instants: int


def drift_of(cameras: Mapping[str, Camera], instants: Sequence[Mapping[str, Outline]]) -> Drift:
    """Cameras that were moved since they were calibrated.  instants: outlines by camera at equal times.

    Two cameras do not determine which one moved: none is named.  Raises ValueError when too little can be compared.
    """
    kept = [one for one in instants if len(one) > 1]
    if len(kept) < p.LEAST_INSTANTS:
        raise ValueError(
            f"the person is seen by two cameras in {len(kept)} frame sets: allowed: {p.LEAST_INSTANTS} or more"
        )
    kept = [kept[k] for k in np.unique(np.linspace(0, len(kept) - 1, p.MOST_INSTANTS).astype(int))]
    names = [name for name in cameras if sum(name in one for one in kept) >= p.LEAST_INSTANTS]
    rays = {name: hulls_of(cameras[name], [one.get(name) for one in kept]) for name in names}
    scene = scene_centre([cameras[name] for name in names], [[one[name] for one in kept if name in one] for name in names])
    present = {name: cameras[name] for name in names}
    moved: list[MovedCamera] = []
    residuals = {pair: pair_residuals(present, rays, pair, scene) for pair in combinations(names, 2)}
    pairs_px = {pair: median_px(one) for pair, one in residuals.items() if np.isfinite(one).sum() >= p.LEAST_INSTANTS}
    checked = [name for name in names if any(name in pair for pair in pairs_px)]
    if not checked:
        raise ValueError("no two cameras show the person whole, from different sides, at the same time")
    candidates = list(checked) if len(checked) > 2 else []
    while candidates and len(checked) - len(moved) > 2:
        found = _most_moved(present, rays, candidates, scene, cameras)
        if found is None:
            break
        moved.append(found)
        present[found.name] = found.camera
        candidates.remove(found.name)
    return Drift(tuple(moved), pairs_px, tuple(name for name in cameras if name not in checked), len(kept))


def _most_moved(
    cameras: Mapping[str, Camera],
    rays: Mapping[str, Hulls],
    candidates: Sequence[str],
    scene: Floats,
    calibrated: Mapping[str, Camera],
) -> MovedCamera | None:
    """The candidate whose motion explains most, where that is certain."""
    best: tuple[str, Floats, float] | None = None
    most = 0.0
    for name in candidates:
        motion = _fitted(cameras, rays, name, scene)
        before = float(losses(_residuals(cameras, rays, name, scene, np.zeros(6))).sum())
        after = float(losses(_residuals(cameras, rays, name, scene, motion)).sum())
        if before - after > most:
            best, most = (name, motion, before), before - after
    if best is None:
        return None
    name, motion, before = best
    camera = moved_camera(cameras[name], motion)
    others = _left_out(cameras, rays, name, scene)
    error_px = max(p.LEAST_ERROR_PX, float(jackknife_error([_apart_px(camera, other, scene) for other in others])))
    apart_px = _apart_px(cameras[name], camera, scene)
    if apart_px < max(p.LEAST_PX, p.SURE_ERRORS * error_px) or most < p.EXPLAINED * before:
        return None
    pairs = [pair for pair in combinations(cameras, 2) if name in pair]
    offs = [
        float(np.nanmedian([median_px(pair_residuals(state, rays, pair, scene)) for pair in pairs]))
        for state in (cameras, {**cameras, name: camera})
    ]
    old = calibrated[name]
    return MovedCamera(
        name,
        turn_deg(camera, old),
        float(jackknife_error([turn_deg(other, camera) for other in others])),
        float(np.linalg.norm(camera.centre - old.centre)),
        float(jackknife_error([np.linalg.norm(other.centre - camera.centre) for other in others])),
        apart_px,
        error_px,
        offs[0],
        offs[1],
        camera,
    )


def _left_out(cameras: Mapping[str, Camera], rays: Mapping[str, Hulls], name: str, scene: Floats) -> list[Camera]:
    """The moved camera, fitted without one stretch of time each: errors of neighbouring instants are alike."""
    count = len(rays[name].local)
    found = []
    for block in np.array_split(np.arange(count), p.BLOCKS):
        kept = np.setdiff1d(np.arange(count), block)
        part = {other: Hulls(one.local[kept], one.cut[kept]) for other, one in rays.items()}
        found.append(moved_camera(cameras[name], _fitted(cameras, part, name, scene)))
    return found


def turn_deg(one: Camera, other: Camera) -> float:
    """Angle between the attitudes of two cameras, degrees."""
    return float(np.degrees(np.linalg.norm(cv2.Rodrigues(one.rotation @ other.rotation.T)[0])))


def moved_camera(camera: Camera, motion: Floats) -> Camera:
    """The camera moved by (6,): rotation vector and shift in its frame, rad and m."""
    turn = np.asarray(cv2.Rodrigues(motion[:3])[0], dtype=np.float64)
    return replace(camera, rotation=turn @ camera.rotation, translation=turn @ camera.translation + motion[3:])


def _fitted(cameras: Mapping[str, Camera], rays: Mapping[str, Hulls], name: str, scene: Floats) -> Floats:
    """Motion (6,) of a camera that makes its pairs agree; small motions are the more likely."""
    widths = np.array([np.radians(p.PRIOR_TURN_DEG)] * 3 + [p.PRIOR_SHIFT_M] * 3)

    def off(scaled: Floats) -> Floats:
        return np.concatenate([np.sqrt(losses(_residuals(cameras, rays, name, scene, scaled * widths))), scaled])

    return np.asarray(least_squares(off, np.zeros(6), max_nfev=30).x * widths, dtype=np.float64)


def _residuals(
    cameras: Mapping[str, Camera], rays: Mapping[str, Hulls], name: str, scene: Floats, motion: Floats
) -> Floats:
    """Differences of the tangent angles in all pairs of one moved camera, in standard deviations; 0 where there is none.

    One that the motion makes unknown keeps its value: a motion must not win by what it hides.
    """
    moved = {**cameras, name: moved_camera(cameras[name], motion)}
    pairs = [pair for pair in combinations(cameras, 2) if name in pair]
    before = np.concatenate([pair_residuals(cameras, rays, pair, scene) for pair in pairs])
    after = np.concatenate([pair_residuals(moved, rays, pair, scene) for pair in pairs])
    return np.where(np.isfinite(before), np.where(np.isfinite(after), after, before), 0.0)


def _apart_px(one: Camera, other: Camera, scene: Floats) -> float:
    """Distance in the image between a person as two poses of a camera show it: of the middle, the head and the feet."""
    body = scene + np.array([[0.0, -0.8, 0.0], [0.0, 0.0, 0.0], [0.0, 0.8, 0.0]])
    return float(np.nanmean(np.linalg.norm(one.project(body) - other.project(body), axis=1)))
