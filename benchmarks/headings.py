"""Start in the T-pose at every heading, with the paper's two cameras: who starts, and facing where.

    python -m benchmarks.headings [--people 4] [--first-person 48] [--every 15] [--size 160x120] [--method hybrid] [--front]

Simulated people hold the T-pose for 3 s, from the video, at 15 frames/s; then they lower the arms.  heading: 0 towards
camera 1, positive towards +X, degrees.  reversed: the yaw is more than 90° off after the last frame.  at start: it is in
the first frame.  --front: with the user's decision: the nearer camera (`--front`) where it is less than FACING_DEG away
from the heading, else the heading to the nearest 45° (`--heading`).
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pool

import cv2
import numpy as np

from benchmarks.errors import Estimate, frame_error
from benchmarks.loop import track_film, tracker_film
from benchmarks.table import Cell, table
from benchmarks.takes import FPS, VIEWERS, Film, Size
from tests.support.simulated_cameras import paper_cameras
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import PersonPose, Placement, interpolate, neutral, place
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

METHODS = ("hybrid", "two-view")
EMPTY_FRAMES, T_POSE_S, LOWERING_S = 15, 3.0, 1.0
CAMERA_HEADINGS = dict(zip(VIEWERS, (0, 270), strict=True))  # degrees, towards the paper's cameras
FACING_DEG = 80


@dataclass(frozen=True)
class Start:
    """How one person started.  after_s: from the first frame of the T-pose, None: never.

    yaw: error after the last frame, degrees.  joints: mean error over the frames since the start, mm.
    first_yaw: error in the first frame with a pose, degrees.
    """

    person: int
    heading: int
    after_s: float | None
    yaw: float
    joints: float
    first_yaw: float


def heading_film(seed: int, heading: int, size: Size) -> Film:
    """Empty room, T-pose at a heading in degrees with the sway of a standing person, arms lowered."""
    subject = person(seed)
    held, lowering = round(T_POSE_S * FPS), round(LOWERING_S * FPS)
    shares = [0.0] * held + [k / lowering for k in range(1, lowering + 1)]
    at = Placement(yaw=float(np.radians(heading)))
    poses: list[PersonPose | None] = [None] * EMPTY_FRAMES
    poses += [place(interpolate(t_pose(subject), neutral(subject), share), at) for share in shares]
    cameras = dict(zip(VIEWERS, paper_cameras(size), strict=True))
    images = {}
    for viewer, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, 1000 * seed + heading)
        images[viewer] = np.stack([renderer.render(pose, k) for k, pose in enumerate(poses)])
    truths = tuple(None if pose is None else truth(subject, pose) for pose in poses)
    return Film(cameras, images, truths, EMPTY_FRAMES, EMPTY_FRAMES)


def decision(heading: int) -> tuple[str | None, float | None]:
    """The camera that a user would name for a heading in degrees, or the heading in radians."""
    away = {viewer: abs((heading - at + 180) % 360 - 180) for viewer, at in CAMERA_HEADINGS.items()}
    nearest = min(away, key=lambda viewer: away[viewer])
    return (nearest, None) if away[nearest] < FACING_DEG else (None, float(np.radians(45 * round(heading / 45))))


def started(job: tuple[int, int], size: Size, method: str, decided: bool = False) -> Start:
    cv2.setNumThreads(1)
    seed, heading = job
    rendered = heading_film(seed, heading, size)
    found: dict[int, Estimate]
    if method == "hybrid":
        front, direction = decision(heading) if decided else (None, None)
        found = tracker_film(rendered, FPS, front=front, heading=direction)
    else:
        track = track_film(rendered, FPS)
        every = {k: track.estimate(k) for k in range(len(rendered.truths))}
        found = {k: one for k, one in every.items() if one is not None}
    errors = []
    for k, one in found.items():
        true = rendered.truths[k]
        if true is not None:
            errors.append(frame_error(one, true))
    if not errors:
        return Start(seed, heading, None, float("nan"), float("nan"), float("nan"))
    joints = float(np.mean([error.joints.mean() for error in errors]))
    return Start(seed, heading, (min(found) - EMPTY_FRAMES) / FPS, errors[-1].yaw, joints, errors[0].yaw)


def row(name: str, starts: Sequence[Start]) -> list[Cell]:
    known = [one for one in starts if one.after_s is not None]
    times = [one.after_s for one in known if one.after_s is not None]
    right = [one for one in known if one.yaw < 90.0]
    return [
        name,
        f"{len(known)} of {len(starts)}",
        sum(one.first_yaw > 90.0 for one in known),
        len(known) - len(right),
        f"{np.median(times):.1f} ({max(times):.1f})" if times else "–",
        f"{np.mean([one.yaw for one in right]):.1f} ({max(one.yaw for one in right):.1f})" if right else "–",
        f"{np.mean([one.joints for one in right]):.0f} ({max(one.joints for one in right):.0f})" if right else "–",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=4)
    parser.add_argument("--first-person", type=int, default=48)
    parser.add_argument("--every", type=int, default=15, help="degrees between two headings (default 15)")
    parser.add_argument("--size", default="160x120", metavar="WxH")
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    parser.add_argument("--front", action="store_true", help="with the user's decision; method hybrid only")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    width, height = (int(number) for number in options.size.split("x"))
    if options.front and options.method != "hybrid":
        parser.error("--front: allowed with --method hybrid")
    headings = range(0, 360, options.every)
    jobs = [(options.first_person + k, heading) for heading in headings for k in range(options.people)]
    run = partial(started, size=(width, height), method=options.method, decided=options.front)
    with Pool(options.jobs) as pool:
        found = pool.map(run, jobs, chunksize=1)
    rows = [row(str(heading), [one for one in found if one.heading == heading]) for heading in headings]
    columns = (
        "heading", "start", "reversed at start", "reversed", "after s (last)", "yaw error ° (worst)", "joints mm (worst)",
    )  # fmt: skip
    decided = ", with the user's decision" if options.front else ""
    title = f"{options.method}, {options.people} people, {options.size}{decided}"
    print(table(title, columns, [*rows, row("all", found)]))


if __name__ == "__main__":
    main()
