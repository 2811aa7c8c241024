"""The tracker on simulated people with motion capture: choices are made here, never on the shared clips.

    python -m benchmarks.motion_capture [--views 2 4 7] [--people 5] [--first-person 108] [--seeds 1] [--motions NAME ...]

Exact silhouettes of 320 x 240 at 30 frames/s with ragged edges, from cameras in a ring, or for two views from the
paper's.  shape: RMSE without each joint's constant offset.  lost: joints without estimate or more than 250 mm off.
"""

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing import Pool

import cv2
import numpy as np

from benchmarks.captured import captured_take
from benchmarks.clips import SHARED
from benchmarks.hybrid.runs import Case, Run, run
from benchmarks.hybrid.silhouettes import Instant
from benchmarks.table import Cell, table
from benchmarks.takes import default_folder, simulation_digest
from tests.support.simulated_cameras import look, paper_cameras
from zenocap.common.arrays import Bytes, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.prior.file import find_prior, read_prior
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.rendering.camera import SimulatedCamera

MOTIONS = ("02_04", "02_07", "02_08", "07_01", "07_05", "10_01")  # jump, sword, broom, walks, kick; not in the clips
SIZE, FPS, LONGEST_S = (320, 240), 30.0, 6.0
RING, DISTANCE_M, HEIGHT_M = 8, 4.6, 1.6
RINGS = {2: (), 3: (0, 3, 6), 4: (0, 2, 4, 6), 7: (0, 1, 2, 3, 4, 5, 6)}  # cameras of the ring, by number of views
RAGGED = 0.3  # share of the pixels at the edge that are exchanged with the background
PRIOR = "general"


@dataclass(frozen=True)
class Shot:
    """One simulated person with one motion, seen by `views` cameras."""

    person: int
    motion: str
    views: int


@dataclass(frozen=True)
class SimulatedClip:
    """Silhouettes and ground truth of one shot; stands in for a shared clip."""

    cameras: Mapping[str, Camera]
    instants: tuple[Instant, ...]
    truth: Trajectories
    motion_from: int
    frame_ns: int = round(1e9 / FPS)

    def of_views(self, _views: tuple[str, ...]) -> "SimulatedClip":
        return self

    def masks(self, instant: Instant, views: Mapping[str, Camera]) -> dict[str, Mask]:
        return {view: np.unpackbits(instant.masks[view], axis=1, count=SIZE[0]) for view in views}


def cameras_of(views: int) -> dict[str, Camera]:
    if views == 2:
        return {camera.name: camera for camera in paper_cameras(SIZE)}
    angles = [2 * np.pi * k / RING for k in RINGS[views]]
    middle = np.array([0.0, 1.0, 0.0])
    places = [np.array([DISTANCE_M * np.sin(a), HEIGHT_M, DISTANCE_M * np.cos(a)]) for a in angles]
    return {f"r{k}": look(f"r{k}", place, middle).resized(SIZE) for k, place in zip(RINGS[views], places, strict=True)}


def clip_of(shot: Shot) -> SimulatedClip:
    """The shot's silhouettes, rendered once for each camera and kept."""
    subject, cameras = person(shot.person), cameras_of(shot.views)
    take = captured_take(subject, SHARED / "motions" / f"cmu_{shot.motion}.bvh", FPS, longest_s=LONGEST_S)
    masks = {}
    for view, camera in cameras.items():
        path = default_folder() / f"masks-{shot.person}-{shot.motion}-{view}-{simulation_digest()}.npz"
        if not path.is_file():
            path.parent.mkdir(parents=True, exist_ok=True)
            film = SimulatedCamera(camera, subject, shot.person)
            packed = np.stack([np.packbits(film.silhouette(pose) != 0, axis=1) for pose in take.poses])
            part = path.with_suffix(f".{time.time_ns()}.npz")
            np.savez(part, allow_pickle=False, masks=packed)
            part.replace(path)
        with np.load(path) as kept:
            masks[view] = _ragged(kept["masks"], shot.person)
    truths = [None if pose is None else truth(subject, pose).joints for pose in take.poses]
    first = next(k for k, one in enumerate(truths) if one is not None)
    names = tuple(next(one for one in truths if one is not None))
    points = np.array([[one[name] for name in names] for one in truths if one is not None])
    frames = np.arange(first, len(truths), dtype=np.int64)
    instants = tuple(
        Instant(k, round(k * 1e9 / FPS), {view: masks[view][k] for view in cameras}) for k in range(first, len(truths))
    )
    return SimulatedClip(cameras, instants, Trajectories(names, frames, frames / FPS, points, FPS), take.motion_from)


def _ragged(packed: Bytes, seed: int) -> Bytes:
    """Masks (n, rows, bytes) with noise at their edges, as segmentation leaves it."""
    rng, kernel, out = np.random.default_rng(seed), np.ones((3, 3), np.uint8), np.empty_like(packed)
    for k, one in enumerate(packed):
        mask = np.unpackbits(one, axis=1, count=SIZE[0])
        edge = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, kernel) != 0
        flipped = edge & (rng.random(mask.shape) < RAGGED / 2)
        out[k] = np.packbits(np.where(flipped, 1 - mask, mask), axis=1)
    return out


def tracked(job: tuple[Shot, Case]) -> Run:
    cv2.setNumThreads(1)
    shot, case = job
    prior = read_prior(find_prior(case.prior)) if case.prior else None
    return run(clip_of(shot), case, prior)  # type: ignore[arg-type]  # has what `run` uses of a clip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", type=int, nargs="+", choices=tuple(RINGS), default=[2, 4])
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--first-person", type=int, default=108)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--motions", nargs="+", choices=MOTIONS, default=MOTIONS, metavar="NAME")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    missing = [str(path) for path in (SHARED / "motions" / f"cmu_{name}.bvh" for name in MOTIONS) if not path.exists()]
    if missing:
        print(f"motion_capture: skipped: {', '.join(missing)} missing (expected beside the checkout)")
        return
    rows: list[list[Cell]] = []
    with Pool(options.jobs) as pool:
        for views in options.views:
            for motion in options.motions:
                shots = [Shot(options.first_person + k, motion, views) for k in range(options.people)]
                cases = [Case("", seed, prior=PRIOR) for seed in range(options.seeds)]
                runs = pool.map(tracked, [(shot, case) for case in cases for shot in shots], chunksize=1)
                rows.append(_row(f"{views} {motion}", runs))
                print("  ".join(str(cell) for cell in rows[-1]), flush=True)
            rows.append(_mean(f"{views} all", rows[-len(options.motions) :]))
    columns = ("views, motion", "mean mm", "worst", "shape mm", "worst", "lost %", "worst", "never", "jumps", "cpu ms")
    print(table("Simulated people with motion capture, hybrid", columns, rows))


def _row(name: str, runs: list[Run]) -> list[Cell]:
    """never: takes without any pose.  jumps: frames in which the mean error changes by more than 100 mm."""
    started = [one for one in runs if one.errors]
    figures: list[Cell] = []
    for key in ("mean_mm", "shape_mm"):
        values = [getattr(one, key) for one in started]
        figures += [round(float(np.mean(values)), 1), round(float(np.max(values)), 1)] if values else [float("nan")] * 2
    lost = [one.lost_pct for one in runs]
    jumps = sum(int(np.count_nonzero(np.abs(np.diff(one.errors)) > 100)) for one in started)
    cpu = float(np.median([one.cpu_ms for one in runs]))
    return [
        name,
        *figures,
        round(float(np.mean(lost)), 2),
        round(max(lost), 1),
        len(runs) - len(started),
        jumps,
        round(cpu, 1),
    ]


def _mean(name: str, rows: list[list[Cell]]) -> list[Cell]:
    """Mean of means, largest of worst figures, sum of counts, mean time."""
    columns = np.array([row[1:] for row in rows], dtype=np.float64).T
    joined = np.where([False, True] * 3 + [False] * 3, np.nanmax(columns, axis=1), np.nanmean(columns, axis=1))
    joined[6:8] = columns[6:8].sum(axis=1)
    return [name, *(round(float(value), 2) for value in joined)]


if __name__ == "__main__":
    main()
