"""The tracker on simulated people with motion capture: choices are made here, never on the shared clips.

    python -m benchmarks.motion_capture [--views 2 4 7] [--people 5] [--first-person 108] [--seeds 1] [--motions NAME ...]

Exact silhouettes of 320 x 240 at 30 frames/s with ragged edges, from cameras in a ring, or for two views from the
paper's.  shape: RMSE without each joint's constant offset.  lost: joints without estimate or more than 250 mm off.
"""

import argparse
from dataclasses import dataclass
from multiprocessing import Pool

import cv2
import numpy as np

from benchmarks.captured import captured_take
from benchmarks.clips import SHARED
from benchmarks.hybrid.runs import Case, Run, run
from benchmarks.simulated_clip import RINGS, SimulatedClip, simulated_clip
from benchmarks.table import Cell, table
from zenocap.services.tracker.prior.file import find_prior, read_prior
from zenocap.simulation.body.person import person

MOTIONS = ("02_04", "02_07", "02_08", "07_01", "07_05", "10_01")  # jump, sword, broom, walks, kick; not in the clips
FPS, LONGEST_S = 30.0, 6.0
PRIOR = "general"


@dataclass(frozen=True)
class Shot:
    """One simulated person with one motion, seen by `views` cameras."""

    person: int
    motion: str
    views: int


def clip_of(shot: Shot) -> SimulatedClip:
    """The shot's silhouettes and truth."""
    subject = person(shot.person)
    take = captured_take(subject, SHARED / "motions" / f"cmu_{shot.motion}.bvh", FPS, longest_s=LONGEST_S)
    return simulated_clip(shot.motion, subject, take.poses, take.motion_from, FPS, shot.views)


def tracked(job: tuple[Shot, Case]) -> Run:
    cv2.setNumThreads(1)
    shot, case = job
    prior = read_prior(find_prior(case.prior)) if case.prior else None
    return run(clip_of(shot), case, prior)


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
