"""Starts of the tracker without a T-pose: two cameras, simulated people who appear in the middle of a motion.

    python -m benchmarks.starts [--people 4] [--first-person 12] [--size 160x120] [--posture [NAME ...]] [--jobs 2]

Every take is tracked twice over the same frames: as filmed, and without the frames between the empty scene and the motion,
which are those of the T-pose.  Motions: of the shared motion capture files; with --posture, these postures, or all
fifteen.
after s: from the first frame of the person to the first pose.  yaw, joints: over the frames from SETTLED_S on.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from multiprocessing import Pool

import cv2
import numpy as np

from benchmarks.clips import SHARED
from benchmarks.errors import Estimate, frame_error
from benchmarks.loop import tracker_film
from benchmarks.table import Cell, table
from benchmarks.takes import SMALL, CapturedTake, Film, Size, Take, default_folder, film
from benchmarks.variants import MOTIONS
from zenocap.simulation.motion.posture_style import POSTURES

SETTLED_S = 2.0  # from the first frame of the motion on: errors are compared after it
REVERSED_DEG = 90.0


@dataclass(frozen=True)
class Start:
    """after_s: None: no pose.  yaw: median error, degrees.  joints: mean error, mm; lost: share of frames without a pose.

    with_t_pose: joints and yaw of the same frames after the T-pose.
    """

    name: str
    after_s: float | None
    yaw: float
    joints: float
    lost: float
    with_t_pose: tuple[float, float]


def without_t_pose(whole: Film) -> Film:
    """The film without the frames between the empty scene and the motion."""
    kept = [*range(whole.empty), *range(whole.motion_from, len(whole.truths))]
    return replace(
        whole,
        images={viewer: images[kept] for viewer, images in whole.images.items()},
        truths=tuple(whole.truths[k] for k in kept),
        motion_from=whole.empty,
    )


def _errors(filmed: Film, found: Mapping[int, Estimate], fps: float) -> tuple[float, float, float]:
    """Mean joint error in mm, median yaw error in degrees, and share of frames without an estimate, once settled."""
    frames = range(filmed.motion_from + round(SETTLED_S * fps), len(filmed.truths))
    errors = []
    for k in frames:
        true = filmed.truths[k]
        assert true is not None
        if k in found:
            errors.append(frame_error(found[k], true))
    if not errors:
        return float("nan"), float("nan"), 1.0
    joints = float(np.mean([error.joints.mean() for error in errors]))
    return joints, float(np.median([error.yaw for error in errors])), 1.0 - len(errors) / len(frames)


def started(take: Take | CapturedTake) -> Start:
    cv2.setNumThreads(1)
    whole = film(take, default_folder() if take.size == SMALL else None)
    cut = without_t_pose(whole)
    found = tracker_film(cut, take.fps)
    joints, yaw, lost = _errors(cut, found, take.fps)
    measured = _errors(whole, tracker_film(whole, take.fps), take.fps)
    name = take.posture if isinstance(take, Take) else take.motion.stem
    after_s = (min(found) - cut.motion_from) / take.fps if found else None
    return Start(name, after_s, yaw, joints, lost, measured[:2])


def _worst(values: Sequence[float]) -> str:
    return f"{np.nanmean(values):.0f} ({np.nanmax(values):.0f})"


def row(name: str, starts: Sequence[Start]) -> list[Cell]:
    times = [one.after_s for one in starts if one.after_s is not None]
    return [
        name,
        f"{len(times)} of {len(starts)}",
        f"{np.median(times):.1f} ({max(times):.1f})" if times else "–",
        sum(one.yaw > REVERSED_DEG for one in starts),
        f"{np.nanmedian([one.yaw for one in starts]):.0f}",
        _worst([one.joints for one in starts]),
        f"{100 * np.mean([one.lost for one in starts]):.1f}",
        sum(one.with_t_pose[1] > REVERSED_DEG for one in starts),
        _worst([one.with_t_pose[0] for one in starts]),
    ]


def chosen(options: argparse.Namespace, size: Size) -> Sequence[Take | CapturedTake]:
    people = range(options.first_person, options.first_person + options.people)
    if options.posture is not None:
        return [Take(seed, posture, 0, size) for seed in people for posture in options.posture or POSTURES]
    motions = [SHARED / "motions" / f"cmu_{name}.bvh" for name in MOTIONS]
    return [CapturedTake(seed, motion, size) for seed in people for motion in motions]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=4)
    parser.add_argument("--first-person", type=int, default=12)
    parser.add_argument("--size", default="160x120", metavar="WxH")
    parser.add_argument("--posture", nargs="*", choices=POSTURES, metavar="NAME", help="postures instead of motion capture")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    if options.posture is None and not (SHARED / "motions").is_dir():
        print(f"starts: skipped: {SHARED / 'motions'} missing (the shared test data are expected beside the checkout)")
        return
    width, height = (int(number) for number in options.size.split("x"))
    takes = chosen(options, (width, height))
    with Pool(options.jobs) as pool:
        found = pool.map(started, takes, chunksize=1)
    names = list(dict.fromkeys(one.name for one in found))
    rows = [row(name, [one for one in found if one.name == name]) for name in names]
    columns = (
        "motion", "start", "after s (last)", "reversed", "yaw °", "joints mm (worst)", "no pose %", "reversed, T-pose",
        "joints mm (worst), T-pose",
    )  # fmt: skip
    title = f"Without and with a T-pose, {options.people} people, {options.size}"
    print(table(title, columns, [*rows, row("all", found)]))


if __name__ == "__main__":
    main()
