"""Calibration from a walk: errors on simulated walkers with known truth, and the claimed error beside them.

    python -m benchmarks.walk_calibration [--seeds 5] [--views 2,3,4,8] [--per-s 8]
    python -m benchmarks.walk_calibration --clips FOLDER FOLDER --height M
    python -m benchmarks.walk_calibration --delays 0,0.01,0.1,0.25,1 [--views 3] [--seeds 5] [--first-seed 20] [--fps 30]
    python -m benchmarks.walk_calibration --tracker [--seeds 5] [--views 4]

Adults walk a figure of eight for 20 s, seen in 320 x 240 with ragged edges by cameras at 4 to 6 m, 0.9 to 2.6 m high and
rolled by up to 4 degrees, whose poses are unknown.  Per number of views the mean and the worst of the seeds: rotation and
place of the worst camera after the best motion, scale, tilt of the vertical, error of places in the walked area (0 to 1.8 m
high), the claimed one.  failed: no calibration; poor: verdict.  With clips: the same against their calibrations.
--delays: the second camera is out of step by these seconds: what was found of it, and the calibration with it.
With --sync: what `zenocap sync TAKE` finds of the delay, with the true cameras.
--tracker: people who walk in a circle of 1.5 m for 9 s are tracked with the true cameras, and with those from their walk,
moved rigidly to the true ones: mean error of the joints, and without each joint's constant offset.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import cv2
import numpy as np
from benchmarks.hybrid.runs import Case, run
from benchmarks.simulated_clip import cycle_clip

from tests.support.walkers import Walker, walker
from zenocap.common.arrays import Floats
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.lags.tangents import outline_of
from zenocap.simulation.body.person import person
from zenocap.tools.calibration.silhouettes import Hulls, hulls_of
from zenocap.tools.calibration.walk.calibration import WalkCalibration, apart_m, calibrated_films, calibrated_walk
from zenocap.tools.calibration.walk.delays import Timing
from zenocap.tools.calibration.walk.films import filmed
from zenocap.tools.calibration.walk.parameters import PER_S
from zenocap.tools.calibration.walk.report import verdict
from zenocap.tools.calibration.walk.series import series_of
from zenocap.tools.sync.take import delays_between

CIRCLE_EVERY = 8  # frames of 60 a second
NAMES = ("rotation, deg", "place, mm", "scale, %", "vertical, deg", "error, mm", "claimed, mm", "worst, mrad")


def errors(found: WalkCalibration, true: Mapping[str, Camera]) -> tuple[float, ...]:
    """Figures of NAMES."""
    cameras = {one.camera.name: one.camera for one in found.cameras}
    turn = best_turn(cameras, true)
    there = np.array([turn @ camera.centre for camera in cameras.values()])
    right_places = np.array([true[name].centre for name in cameras])
    there, right_places = there - there.mean(axis=0), right_places - right_places.mean(axis=0)
    turned = [cv2.Rodrigues(camera.rotation @ turn.T @ true[name].rotation.T)[0] for name, camera in cameras.items()]
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-1, 1, 60), rng.uniform(0, 1.8, 60), rng.uniform(-1, 1, 60)])
    return (
        max(float(np.degrees(np.linalg.norm(one))) for one in turned),
        1e3 * float(np.linalg.norm(there - right_places, axis=1).max()),
        100.0 * (float(np.sqrt((there**2).sum() / (right_places**2).sum())) - 1.0),
        float(np.degrees(np.arccos(np.clip(turn[1, 1], -1.0, 1.0)))),
        1e3 * float(np.sqrt(np.mean(apart_m(true, cameras, points) ** 2))),
        1e3 * found.error_m,
        max(one.off_mrad for one in found.cameras),
    )


def best_turn(cameras: Mapping[str, Camera], true: Mapping[str, Camera]) -> Floats:
    """Rotation (3, 3) from the world of `cameras` to the true one, least squares of their orientations (Kabsch)."""
    left, _, right = np.linalg.svd(sum(true[name].rotation.T @ camera.rotation for name, camera in cameras.items()))
    turn: Floats = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return turn


def simulated(seed: int, views: int, per_s: float) -> tuple[WalkCalibration, Mapping[str, Camera]]:
    """Calibration from one walker, and the true cameras.  Raises UserError."""
    one = walker(seed, views)
    instants = list(one.instants(per_s))
    hulls: dict[str, Hulls] = {}
    for name, camera in one.cameras.items():
        own = replace(camera, rotation=np.eye(3), translation=np.zeros(3))
        hulls[name] = hulls_of(own, [outline_of(own, instant[name], 0.0) for instant in instants])
    return calibrated_walk(one.cameras, hulls, one.person.height), one.cameras


def timed(seed: int, views: int, delay_s: float, fps: float, seconds: float = 20.0) -> tuple[WalkCalibration, Walker]:
    """Calibration from films at full rate, of which the second camera's is late, and the walker.  Raises UserError."""
    one = walker(seed, views)
    times = np.arange(int(min(seconds, one.motion.duration_s) * fps)) / fps
    series = {}
    for k, (name, camera) in enumerate(one.cameras.items()):
        own = replace(camera, rotation=np.eye(3), translation=np.zeros(3))
        late = np.clip(times + delay_s * (k == 1), 0.0, one.motion.duration_s)
        outlines = [outline_of(own, mask, time_s) for mask, time_s in zip(one.film(name, late), times, strict=True)]
        series[name] = series_of(times, hulls_of(own, outlines))
    timing = Timing(series, np.arange(0.0, times[-1], 1.0 / PER_S))
    return calibrated_films(one.cameras, timing, one.person.height), one


def live_table(delays_s: Sequence[float], views: Sequence[int], seeds: Sequence[int], fps: float) -> None:
    """Print what `zenocap sync TAKE` finds for each delay, from the silhouettes of 15 s and the true cameras."""
    print("views   late, s  seed   error, frames (claimed)   worst error of the others, frames")
    times = np.arange(int(15.0 * fps)) / fps
    for count, delay_s, seed in product(views, delays_s, seeds):
        one = walker(seed, count)
        outlines = {}
        for k, (name, camera) in enumerate(one.cameras.items()):
            film = one.film(name, np.maximum(0.0, times - delay_s * (k == 1)))
            found = [outline_of(camera, mask, time_s) for mask, time_s in zip(film, times, strict=True)]
            outlines[name] = [its for its in found if its is not None]
        delays = delays_between(one.cameras, outlines)
        if delays.uncertain:
            print(f"{count:5} {delay_s:9.3f} {seed:5}   not certain: {', '.join(delays.uncertain)}", flush=True)
            continue
        off = {name: its.offset_s * fps for name, its in delays.offsets.items()}
        others = max((abs(value) for name, value in off.items() if name != "cam02"), default=0.0)
        claimed = delays.offsets["cam02"].error_s * fps
        late = f"{off['cam02'] + delay_s * fps:+.2f} ({claimed:.2f})"
        print(f"{count:5} {delay_s:9.3f} {seed:5} {late:>18} {others:14.2f}", flush=True)


def delay_table(delays_s: Sequence[float], views: Sequence[int], seeds: Sequence[int], fps: float) -> None:
    """Print, for each delay and number of views, what was found of each seed."""
    print("views   late, s  seed   found - true, frames (claimed, s)  worst other, s  rotation, deg  error, mm  verdict")
    for count, delay_s, seed in product(views, delays_s, seeds):
        try:
            found, one = timed(seed, count, delay_s, fps)
        except UserError as error:
            print(f"{count:5} {delay_s:9.3f} {seed:5}   refused: {error}", flush=True)
            continue
        late = found.delays["cam02"]
        others = max((abs(its.seconds) for name, its in found.delays.items() if name != "cam02"), default=0.0)
        rotation_deg, *_, error_mm, _, _ = errors(found, one.cameras)
        print(
            f"{count:5} {delay_s:9.3f} {seed:5} {(late.seconds - delay_s) * fps:14.2f} ({late.error_s:.3f})"
            f"{'  used' if late.is_certain else '  as 0'} {others:14.3f} {rotation_deg:14.2f} {error_mm:10.0f}  "
            f"{verdict(found)[0]}",
            flush=True,
        )


def tracked(seed: int, views: int) -> tuple[float, float, float, float]:
    """Mean error and error of the shape, mm, of the tracker with true and with found cameras.  Raises UserError."""
    clip = cycle_clip(f"walking-{seed}", views)
    instants = [clip.masks(instant, clip.cameras) for instant in clip.instants[clip.motion_from :: CIRCLE_EVERY]]
    hulls: dict[str, Hulls] = {}
    for name, camera in clip.cameras.items():
        own = replace(camera, rotation=np.eye(3), translation=np.zeros(3))
        hulls[name] = hulls_of(own, [outline_of(own, instant[name], 0.0) for instant in instants])
    found = calibrated_walk(clip.cameras, hulls, person(seed).height)
    moved = replace(clip, cameras=aligned({one.camera.name: one.camera for one in found.cameras}, clip.cameras))
    case = Case(clip.name)
    with_true, with_found = run(clip, case, None), run(moved, case, None)
    return with_true.mean_mm, with_true.shape_mm, with_found.mean_mm, with_found.shape_mm


def aligned(cameras: Mapping[str, Camera], true: Mapping[str, Camera]) -> dict[str, Camera]:
    """The cameras moved rigidly, to fit the true ones in orientation and place."""
    turn = best_turn(cameras, true)
    shift = np.mean([true[name].centre - turn @ camera.centre for name, camera in cameras.items()], axis=0)
    found = {}
    for name, camera in cameras.items():
        rotation = camera.rotation @ turn.T
        found[name] = replace(camera, rotation=rotation, translation=-rotation @ (turn @ camera.centre + shift))
    return found


def row(name: str, figures: Sequence[tuple[float, ...]]) -> str:
    """A line of the table: mean (worst)."""
    if not figures:
        return f"{name:12}"
    table = np.array(figures)
    worst = np.take_along_axis(table, np.abs(table).argmax(axis=0)[None], axis=0)[0]
    return f"{name:12}" + "".join(
        f"{mean:9.2f} ({most:6.2f})" for mean, most in zip(table.mean(axis=0), worst, strict=True)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--views", default="2,3,4,8")
    parser.add_argument("--per-s", type=float, default=8.0)
    parser.add_argument("--clips", type=Path, nargs="+")
    parser.add_argument("--height", type=float, default=1.75)
    parser.add_argument("--tracker", action="store_true")
    parser.add_argument("--delays", help="seconds, such as 0.01,0.1")
    parser.add_argument("--sync", action="store_true", help="with --delays: what zenocap sync TAKE finds")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--fps", type=float, default=30.0)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    if options.delays is not None:
        table = live_table if options.sync else delay_table
        table([*map(float, options.delays.split(","))], [*map(int, options.views.split(","))], seeds, options.fps)
        return
    if options.tracker:
        print("views  seed   true cameras: mean, shape   found cameras: mean, shape, mm")
        for views in map(int, options.views.split(",")):
            for seed in seeds:
                print(f"{views:5} {seed:5}", "".join(f"{value:14.1f}" for value in tracked(seed, views)), flush=True)
        return
    print(" " * 12 + "".join(f"{name:>18}" for name in NAMES) + "   failed, poor")
    if options.clips:
        for folder in options.clips:
            reference = read_calibration(folder / "calibration.toml")
            try:
                films = filmed(folder, {name: Lens.of(camera) for name, camera in reference.items()}, 90.0, lambda _: None)
                found = calibrated_films(films.cameras, films.timing, options.height, films.hulls)
            except UserError as error:
                print(f"{folder.name:12} failed: {error}", flush=True)
                continue
            word, reasons = verdict(found)
            print(row(folder.name, [errors(found, reference)]), f"  {word}: {'; '.join(reasons)}", flush=True)
        return
    for views in map(int, options.views.split(",")):
        figures, failed, poor = [], 0, 0
        for seed in seeds:
            try:
                found, true = simulated(seed, views, options.per_s)
            except UserError:
                failed += 1
                continue
            poor += verdict(found)[0] == "poor"
            figures.append(errors(found, true))
        print(row(f"{views} views", figures), f"  {failed}, {poor} of {options.seeds}", flush=True)


if __name__ == "__main__":
    main()
