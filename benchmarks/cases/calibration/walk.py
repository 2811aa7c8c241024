"""Calibration from a walk: errors on simulated walkers, and the claimed error beside them.

Adults walk a figure of eight for 20 s, seen in 320 x 240 with ragged edges by cameras at 4 to 6 m, 0.9 to 2.6 m high and
rolled by up to 4 degrees, whose poses are unknown.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np

from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.simulated_clips import cycle_clip
from benchmarks.people.tracker import ANATOMY, track_clip
from benchmarks.people.tracker import errors as tracking_errors
from tests.support.walkers import Walker, walker
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.lags.tangents import outline_of
from zenocap.services.tracker.states import Options, TrackerSetup
from zenocap.simulation.body.person import person
from zenocap.tools.setup.calibration.silhouettes import Hulls, hulls_of
from zenocap.tools.setup.calibration.walk.calibration import WalkCalibration, apart_m, calibrated_films, calibrated_walk
from zenocap.tools.setup.calibration.walk.delays import SilhouetteSeries, series_of
from zenocap.tools.setup.calibration.walk.parameters import PER_S
from zenocap.tools.setup.calibration.walk.report import verdict
from zenocap.tools.setup.sync.take import delays_between

CIRCLE_EVERY = 8  # frames of 60 a second
FIRST_PERSON = 100  # constants were chosen on 0 to 3
LATE_PERSON = 20  # of the walks with a late camera
LIVE_S = 15.0
FPS, FILM_S = 30.0, 20.0


def run(one: Case) -> Figures:
    """One walker, or one person whose camera is late.  Options: views; delay (s) of the second camera."""
    views, delay_s = one.option("views", 2), one.option("delay", 0.0)
    try:
        if not delay_s:
            found, true = simulated(FIRST_PERSON + one.seed, views, PER_S)
            return errors(found, true) | {"poor": verdict(found)[0] == "poor"}
        found, subject = timed(LATE_PERSON + one.seed, views, delay_s)
    except UserError:
        return {"failed": 1}
    late = found.delays["cam02"]
    off = {"delay": abs(late.seconds - delay_s) * FPS, "delay not used": not late.is_certain}
    return errors(found, subject.cameras) | off | {"poor": verdict(found)[0] == "poor"}


def run_sync(one: Case) -> Figures:
    """What `zenocap sync TAKE` finds of a late camera with the true cameras.  Options: views, delay (s)."""
    subject, delay_s = walker(LATE_PERSON + one.seed, one.option("views", 2)), one.option("delay", 0.1)
    times, outlines = np.arange(int(LIVE_S * FPS)) / FPS, {}
    for k, (name, camera) in enumerate(subject.cameras.items()):
        film = subject.film(name, np.maximum(0.0, times - delay_s * (k == 1)))
        found = [outline_of(camera, mask, time_s) for mask, time_s in zip(film, times, strict=True)]
        outlines[name] = [its for its in found if its is not None]
    delays = delays_between(subject.cameras, outlines)
    if delays.uncertain:
        return {"not certain": 1}
    off = {name: abs(its.offset_s + delay_s * (name == "cam02")) * FPS for name, its in delays.offsets.items()}
    others = [value for name, value in off.items() if name != "cam02"]
    return {"error": off["cam02"], "claimed": delays.offsets["cam02"].error_s * FPS, "others": max(others, default=0.0)}


def run_tracker(one: Case) -> Figures:
    """Errors of the tracker with the true cameras and with those from the person's walk in a circle.  Options: views."""
    clip = cycle_clip(f"walking-{one.seed}", one.option("views", 4))
    instants = [clip.masks(instant, clip.cameras) for instant in clip.instants[clip.motion_from :: CIRCLE_EVERY]]
    try:
        found = calibrated_walk(clip.cameras, hulls_in(clip.cameras, instants), person(one.seed).height)
    except UserError:
        return {"failed": 1}
    moved = replace(clip, cameras=aligned({each.camera.name: each.camera for each in found.cameras}, clip.cameras))
    figures = {}
    for name, film in (("true cameras", clip), ("found cameras", moved)):
        path = track_clip(film, TrackerSetup(ANATOMY, film.cameras, film.frame_ns, None, Options()))
        figures[name] = tracking_errors(path, film.truth, film.motion_from)["mean"]
    return figures


def errors(found: WalkCalibration, true: Mapping[str, Camera]) -> dict[str, float]:
    """Figures of a calibration against the true cameras."""
    cameras = {one.camera.name: one.camera for one in found.cameras}
    turn = best_turn(cameras, true)
    there = np.array([turn @ camera.centre for camera in cameras.values()])
    right_places = np.array([true[name].centre for name in cameras])
    there, right_places = there - there.mean(axis=0), right_places - right_places.mean(axis=0)
    turned = [cv2.Rodrigues(camera.rotation @ turn.T @ true[name].rotation.T)[0] for name, camera in cameras.items()]
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-1, 1, 60), rng.uniform(0, 1.8, 60), rng.uniform(-1, 1, 60)])
    scale = 100.0 * (float(np.sqrt((there**2).sum() / (right_places**2).sum())) - 1.0)
    return {
        "rotation": max(float(np.degrees(np.linalg.norm(one))) for one in turned),
        "place": 1e3 * float(np.linalg.norm(there - right_places, axis=1).max()),
        "scale": abs(scale),
        "vertical": float(np.degrees(np.arccos(np.clip(turn[1, 1], -1.0, 1.0)))),
        "error": 1e3 * float(np.sqrt(np.mean(apart_m(true, cameras, points) ** 2))),
        "claimed": 1e3 * found.error_m,
        "worst camera": max(one.off_mrad for one in found.cameras),
    }


def best_turn(cameras: Mapping[str, Camera], true: Mapping[str, Camera]) -> Floats:
    """Rotation (3, 3) from the world of `cameras` to the true one, least squares of their orientations (Kabsch)."""
    left, _, right = np.linalg.svd(sum(true[name].rotation.T @ camera.rotation for name, camera in cameras.items()))
    turn: Floats = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return turn


def simulated(seed: int, views: int, per_s: float) -> tuple[WalkCalibration, Mapping[str, Camera]]:
    """Calibration from one walker, and the true cameras.  Raises UserError."""
    one = walker(seed, views)
    return calibrated_walk(one.cameras, hulls_in(one.cameras, list(one.instants(per_s))), one.person.height), one.cameras


def hulls_in(cameras: Mapping[str, Camera], instants: Sequence[Mapping[str, Mask]]) -> dict[str, Hulls]:
    """Hulls of the silhouettes of instants, by camera, in its own coordinates."""
    found = {}
    for name, camera in cameras.items():
        own = _at_the_origin(camera)
        found[name] = hulls_of(own, [outline_of(own, instant[name], 0.0) for instant in instants])
    return found


def _at_the_origin(camera: Camera) -> Camera:
    return replace(camera, rotation=np.eye(3), translation=np.zeros(3))


def timed(seed: int, views: int, delay_s: float) -> tuple[WalkCalibration, Walker]:
    """Calibration from films of 20 s at FPS, of which the second camera's is late, and the walker.  Raises UserError."""
    one = walker(seed, views)
    times = np.arange(int(min(FILM_S, one.motion.duration_s) * FPS)) / FPS
    series = {}
    for k, (name, camera) in enumerate(one.cameras.items()):
        own = _at_the_origin(camera)
        late = np.clip(times + delay_s * (k == 1), 0.0, one.motion.duration_s)
        outlines = [outline_of(own, mask, time_s) for mask, time_s in zip(one.film(name, late), times, strict=True)]
        series[name] = series_of(times, hulls_of(own, outlines))
    timing = SilhouetteSeries(series, np.arange(0.0, times[-1], 1.0 / PER_S))
    return calibrated_films(one.cameras, timing, one.person.height), one


def aligned(cameras: Mapping[str, Camera], true: Mapping[str, Camera]) -> dict[str, Camera]:
    """The cameras moved rigidly, to fit the true ones in orientation and place."""
    turn = best_turn(cameras, true)
    shift = np.mean([true[name].centre - turn @ camera.centre for name, camera in cameras.items()], axis=0)
    found = {}
    for name, camera in cameras.items():
        rotation = camera.rotation @ turn.T
        found[name] = replace(camera, rotation=rotation, translation=-rotation @ (turn @ camera.centre + shift))
    return found


WALK = Kind(
    "walk",
    "Simulated adults walk a figure of eight for 20 s, silhouettes of 320×240 with ragged edges, lenses known, poses "
    "unknown; nine people on whom nothing was chosen. Rotation and place: of the worst camera after the best motion; "
    "error: of places in the walked area.",
    run,
    (
        Quantity("rotation", "°", 2),
        Quantity("place", "mm", 0),
        Quantity("scale", "%", 1),
        Quantity("vertical", "°", 2),
        Quantity("error", "mm", 0),
        Quantity("claimed", "mm", 0, ""),
        Quantity("worst camera", "mrad", 1),
        Quantity("delay", "periods", 2),
        *(Quantity(name, "", 0, joined="sum") for name in ("delay not used", "failed", "poor")),
    ),
    {f"{views} cameras": case("walk", views=views) for views in (2, 3, 4, 5, 6, 7, 8)}
    | {
        f"2 cameras, one late by {delay:g} s": case("walk", delay=delay)
        for delay in (0.0333, 0.1, 0.1667, 0.12, 0.25, 0.5, 1.0)
    },
    case("walk"),
    seeds=9,
    rows="cameras",
)
WALK_SYNC = Kind(
    "walk-sync",
    "What `zenocap sync TAKE` finds of one late camera of two, simulated people who walk, 320×240 at 30 frames/s, five of "
    "them.",
    run_sync,
    (
        Quantity("error", "periods", 2),
        Quantity("claimed", "periods", 2, ""),
        Quantity("others", "periods", 2),
        Quantity("not certain", "", 0, joined="sum"),
    ),
    {f"{delay:g} s": case("walk", delay=delay) for delay in (0.01, 0.0333, 0.0667, 0.1667)},
    case("walk", delay=0.0667),
    seeds=5,
    rows="late by",
)
WALK_TRACKER = Kind(
    "walk-tracker",
    "People who walk in a circle of 1.5 m for 9 s, tracked with the true cameras and with those of their own walk; mean "
    "error of the joints, five people.",
    run_tracker,
    (Quantity("true cameras", "mm", 1), Quantity("found cameras", "mm", 1), Quantity("failed", "", 0, joined="sum")),
    {f"{views} cameras": case("circle", views=views) for views in (4, 3)},
    case("circle", views=3),
    seeds=5,
    rows="cameras",
)
