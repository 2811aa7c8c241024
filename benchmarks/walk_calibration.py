"""Calibration from a walk: errors on simulated walkers with known truth, and the claimed error beside them.

    python -m benchmarks.walk_calibration [--seeds 5] [--views 2,3,4,8] [--per-s 8]
    python -m benchmarks.walk_calibration --clips FOLDER FOLDER --height M
    python -m benchmarks.walk_calibration --tracker [--seeds 5] [--views 4]

Adults walk a figure of eight for 20 s, seen in 320 x 240 with ragged edges by cameras at 4 to 6 m, 0.9 to 2.6 m high and
rolled by up to 4 degrees, whose poses are unknown.  Per number of views the mean and the worst of the seeds: rotation and
place of the worst camera after the best motion, scale, tilt of the vertical, error of places in the walked area (0 to 1.8 m
high), the claimed one.  failed: no calibration; poor: verdict.  With clips: the same against their calibrations.
--tracker: people who walk in a circle of 1.5 m for 9 s are tracked with the true cameras, and with those from their walk,
moved rigidly to the true ones: mean error of the joints, and without each joint's constant offset.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from benchmarks.hybrid.runs import Case, run
from benchmarks.simulated_clip import cycle_clip
from tests.support.walkers import walker
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.simulation.body.person import person
from zenocap.tools.calibration.silhouettes import Hulls, hulls_of
from zenocap.tools.calibration.walk.calibration import WalkCalibration, apart_m, calibrated_walk
from zenocap.tools.calibration.walk.films import filmed
from zenocap.tools.calibration.walk.report import verdict
from zenocap.tools.sync.tangents import outline_of

CIRCLE_EVERY = 8  # frames of 60 a second
NAMES = ("rotation, deg", "place, mm", "scale, %", "vertical, deg", "error, mm", "claimed, mm", "worst, mrad")


def errors(found: WalkCalibration, true: Mapping[str, Camera]) -> tuple[float, ...]:
    """Figures of NAMES."""
    cameras = {one.camera.name: one.camera for one in found.cameras}
    left, _, right = np.linalg.svd(sum(true[name].rotation.T @ camera.rotation for name, camera in cameras.items()))
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
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


def simulated(seed: int, views: int, per_s: float) -> tuple[WalkCalibration, Mapping[str, Camera]]:
    """Calibration from one walker, and the true cameras.  Raises UserError."""
    one = walker(seed, views)
    instants = list(one.instants(per_s))
    hulls: dict[str, Hulls] = {}
    for name, camera in one.cameras.items():
        own = replace(camera, rotation=np.eye(3), translation=np.zeros(3))
        hulls[name] = hulls_of(own, [outline_of(own, instant[name], 0.0) for instant in instants])
    return calibrated_walk(one.cameras, hulls, one.person.height), one.cameras


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
    left, _, right = np.linalg.svd(sum(true[name].rotation.T @ camera.rotation for name, camera in cameras.items()))
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
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
    options = parser.parse_args()
    if options.tracker:
        print("views  seed   true cameras: mean, shape   found cameras: mean, shape, mm")
        for views in map(int, options.views.split(",")):
            for seed in range(options.seeds):
                print(f"{views:5} {seed:5}", "".join(f"{value:14.1f}" for value in tracked(seed, views)), flush=True)
        return
    print(" " * 12 + "".join(f"{name:>18}" for name in NAMES) + "   failed, poor")
    if options.clips:
        for folder in options.clips:
            reference = read_calibration(folder / "calibration.toml")
            try:
                films = filmed(folder, {name: Lens.of(camera) for name, camera in reference.items()}, 90.0, lambda _: None)
                found = calibrated_walk(films.cameras, films.hulls, options.height)
            except UserError as error:
                print(f"{folder.name:12} failed: {error}", flush=True)
                continue
            word, reasons = verdict(found)
            print(row(folder.name, [errors(found, reference)]), f"  {word}: {'; '.join(reasons)}", flush=True)
        return
    for views in map(int, options.views.split(",")):
        figures, failed, poor = [], 0, 0
        for seed in range(options.seeds):
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
