"""Camera poses from a walking person: starts, registration, adjustment, errors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.lags.pairs import jackknife_error
from zenocap.tools.setup.calibration.precision import aligned_errors
from zenocap.tools.setup.calibration.silhouettes import Hulls, median_px, pair_residuals
from zenocap.tools.setup.calibration.walk.adjustment import Walk, adjusted, heads_of, middle_of
from zenocap.tools.setup.calibration.walk.delays import Delay, SilhouetteSeries, adjusted_delays, coarse_delays
from zenocap.tools.setup.calibration.walk.parameters import BLOCKS, HEAD_IN_WALK, LEAST_INSTANTS, STATURE_SHARE
from zenocap.tools.setup.calibration.walk.registration import PlanarMotion, joined, pairs_of
from zenocap.tools.setup.calibration.walk.single_view import SingleView, single_view


@dataclass(frozen=True)
class WalkCamera:
    """camera: its result.  instants: at which it sees the person whole.  off_px, off_mrad: median reprojection error."""

    camera: Camera
    instants: int
    off_px: float
    off_mrad: float


@dataclass(frozen=True)
class WalkCalibration:
    """error_m: expected in the walked area, from stretches of time left out, and from the scale.  area_m: its two widths.

    pairs_px: median disagreement of the silhouettes of each pair, px; NaN where the pair cannot be compared.
    delays: of each camera against the first; empty where the silhouettes were given at instants only.
    """

    cameras: tuple[WalkCamera, ...]
    stature_m: float
    instants: int
    area_m: tuple[float, float]
    pairs_px: Mapping[tuple[str, str], float]
    error_m: float
    delays: Mapping[str, Delay] = field(default_factory=dict)


def calibrated_walk(
    lenses: Mapping[str, Camera],
    hulls: Mapping[str, Hulls],
    stature_m: float,
    on_step: Callable[[str], None] = lambda _: None,
) -> WalkCalibration:
    """Calibrate.  lenses: cameras whose poses are not used.  hulls: by camera, at the same instants.

    The world has Y up, the floor at 0, its origin in the middle of the walk and the first camera on +Z.  Raises UserError
    where a camera sees too little, or cannot be connected with the others.
    """
    views = views_of(lenses, hulls, stature_m, on_step)
    start = start_of(lenses, views, on_step)
    on_step("adjusting")
    walk = Walk(hulls, stature_m)
    found, _ = adjusted(start, lambda _: walk)
    on_step("estimating the errors")
    error_m = _error_m(found, walk)
    found = centred(found, heads_of(found, walk).places)
    heads = heads_of(found, walk)
    scene = middle_of(found, walk)
    residuals = {pair: pair_residuals(found, hulls, pair, scene) for pair in combinations(found, 2)}
    cameras = []
    for name, camera in found.items():
        own = np.concatenate([one for pair, one in residuals.items() if name in pair])
        off_px = float(np.nanmax([median_px(own), float(np.nanmedian(heads.off_px[name]))]))
        focal = 0.5 * float(camera.matrix[0, 0] + camera.matrix[1, 1])
        cameras.append(WalkCamera(camera, int(np.isfinite(views[name].track).sum()), off_px, 1e3 * off_px / focal))
    known = heads.places[np.isfinite(heads.places[:, 0])][:, [0, 2]]
    spread = 4.0 * np.sqrt(np.linalg.eigvalsh(np.cov(known.T)))  # of an even distribution the width is 3.5 deviations
    return WalkCalibration(
        tuple(cameras),
        stature_m,
        len(next(iter(hulls.values())).local),
        (float(spread[1]), float(spread[0])),
        {pair: median_px(one) for pair, one in residuals.items()},
        float(np.hypot(error_m, STATURE_SHARE * 0.5 * float(spread[1]))),
    )


def calibrated_films(
    lenses: Mapping[str, Camera],
    timing: SilhouetteSeries,
    stature_m: float,
    hulls: Mapping[str, Hulls] | None = None,
    on_step: Callable[[str], None] = lambda _: None,
) -> WalkCalibration:
    """Calibrate cameras that may be out of step, from their silhouettes as functions of time.

    hulls: those nearest to the instants, which are used where no delay is certain; without, they are interpolated.
    Raises UserError, see `calibrated_walk`.
    """
    in_step = {name: 0.0 for name in lenses}
    near = hulls if hulls is not None else timing.hulls(in_step)
    views = views_of(lenses, near, stature_m, on_step)
    on_step("delays")
    coarse = coarse_delays(views, timing, HEAD_IN_WALK * stature_m)
    if len(coarse) < len(lenses):
        calibrated_walk(lenses, near, stature_m, on_step)  # reports what cannot be connected, and why
        raise UserError("whether the cameras are in step cannot be found: walk longer, in curves; or give sync.toml")
    start = start_of(lenses, views_of(lenses, timing.hulls(coarse), stature_m, on_step), on_step)
    delays = adjusted_delays(start, timing, stature_m, coarse, on_step)
    used = {name: one.seconds if one.is_certain else 0.0 for name, one in delays.items()}
    found = calibrated_walk(lenses, timing.hulls(used) if any(used.values()) else near, stature_m, on_step)
    return replace(found, delays=delays)


def views_of(
    lenses: Mapping[str, Camera], hulls: Mapping[str, Hulls], stature_m: float, on_step: Callable[[str], None]
) -> dict[str, SingleView]:
    """Each camera alone.  Raises UserError where one sees too little."""
    on_step("each camera alone")
    views: dict[str, SingleView] = {}
    for name in lenses:
        view = single_view(hulls[name], HEAD_IN_WALK * stature_m)
        whole = 0 if view is None else int(np.isfinite(view.track).sum())
        if view is None or whole < LEAST_INSTANTS:
            raise UserError(
                f"{name}: the person is whole in {whole} of the compared images: allowed: {LEAST_INSTANTS} or more; place "
                "the camera so that head and feet are in the image"
            )
        views[name] = view
    return views


def start_of(
    lenses: Mapping[str, Camera], views: Mapping[str, SingleView], on_step: Callable[[str], None]
) -> dict[str, Camera]:
    """All cameras in one world, from their tracks.  Raises UserError where they cannot be connected."""
    on_step("comparing the ways")
    pairs = pairs_of({name: view.track for name, view in views.items()})
    _refuse_mirrored(list(lenses), pairs)
    motions = joined(list(lenses), pairs)
    if len(motions) < len(lenses):
        raise UserError(_unconnected(list(lenses), motions, pairs))
    return {name: placed(lenses[name], views[name], motions[name]) for name in lenses}


def placed(lens: Camera, view: SingleView, motion: PlanarMotion) -> Camera:
    """The camera in the world of all ways.  motion: of its own way into it."""
    c, s = motion.turn.real, motion.turn.imag
    turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    rotation = view.rotation @ turn.T
    centre = np.array([motion.shift.real, view.height_m, motion.shift.imag])
    return replace(lens, rotation=rotation, translation=-rotation @ centre)


def centred(cameras: Mapping[str, Camera], places: Floats) -> dict[str, Camera]:
    """The cameras in the world with its origin below the middle of places (n, 3), and the first camera on +Z."""
    middle = np.nanmedian(places, axis=0) * [1.0, 0.0, 1.0]
    towards = next(iter(cameras.values())).centre - middle
    z = np.array([towards[0], 0.0, towards[2]]) / np.hypot(towards[0], towards[2])
    turn = np.stack([np.cross([0.0, 1.0, 0.0], z), [0.0, 1.0, 0.0], z])
    found = {}
    for name, camera in cameras.items():
        rotation = camera.rotation @ turn.T
        found[name] = replace(camera, rotation=rotation, translation=-rotation @ (turn @ (camera.centre - middle)))
    return found


def _error_m(found: Mapping[str, Camera], walk: Walk) -> float:
    """Standard error of points of the walked area, m: a jackknife over stretches of time; errors last for some steps."""
    count = len(next(iter(walk.hulls.values())).local)
    points = heads_of(found, walk).places
    points = points[np.isfinite(points[:, 0])]
    points = points[np.linspace(0, len(points) - 1, min(30, len(points))).astype(int)]
    points = np.concatenate([points, points * [1.0, 0.5, 1.0], points * [1.0, 0.0, 1.0]])
    off = []
    for block in np.array_split(np.arange(count), BLOCKS):
        part = walk.part(np.setdiff1d(np.arange(count), block))
        again, _ = adjusted(found, lambda _, part=part: part, rounds=1)  # type: ignore[misc]
        off.append(np.sqrt(np.mean(apart_m(again, found, points) ** 2)))
    return float(jackknife_error(off))


def apart_m(cameras: Mapping[str, Camera], true: Mapping[str, Camera], points: Floats) -> Floats:
    """Distances (n,) m between points (n, 3) and where `cameras` put what `true` sees of them, moved rigidly to fit."""
    normal, target = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    for name, camera in cameras.items():
        rays = points @ true[name].rotation.T + true[name].translation
        rays = (rays / np.linalg.norm(rays, axis=1, keepdims=True)) @ camera.rotation
        across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
        normal += across
        target += across @ camera.centre
    there = np.linalg.solve(normal + 1e-12 * np.eye(3), target[..., None])[..., 0]
    return aligned_errors(np.asarray(there, dtype=np.float64), points)


def _refuse_mirrored(names: list[str], pairs: Mapping[tuple[str, str], PlanarMotion]) -> None:
    """Raise UserError where an image is mirrored: with two cameras it cannot be told which one."""
    mirrored = [pair for pair, motion in pairs.items() if motion.mirrored]
    if not mirrored:
        return
    counts = {name: sum(name in pair for pair in mirrored) for name in names}
    most = [name for name in names if counts[name] == max(counts.values())]
    raise UserError(
        f"{' or '.join(most)}: the image is mirrored: the way of the person is that of the other cameras in a mirror; "
        "switch mirroring off in the camera"
    )


def _unconnected(
    names: list[str], motions: Mapping[str, PlanarMotion], pairs: Mapping[tuple[str, str], PlanarMotion]
) -> str:
    """Which cameras are not connected with the others, and why."""
    left = [name for name in names if name not in motions]
    left = left if motions else names
    reasons = []
    alone = [name for name in left if not any(name in pair for pair in pairs)]
    if alone:
        reasons.append(
            f"{', '.join(alone)}: seldom sees the person at the same time as another camera, or the person moves less than "
            "a metre"
        )
    for name in left:
        own = [motion for pair, motion in pairs.items() if name in pair]
        if own:
            best = max(own, key=lambda one: one.agreeing / one.common)
            reasons.append(
                f"{name}: its way of the person agrees with the others' in {best.agreeing} of {best.common} frame sets: "
                "are the videos in step (sync.toml), is its lens right, is it the same person?"
            )
    return "not all cameras can be connected: " + "; ".join(reasons)
