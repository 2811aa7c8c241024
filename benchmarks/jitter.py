"""Jitter, error and delay of the tracker's poses: as tracked, smoothed live, smoothed afterwards, tracked both ways.

    python -m benchmarks.jitter [--views 2 4] [--people 5] [--seeds 1] [--motions NAME ...] [--clips NAME ...]

Simulated people with motion capture as in `benchmarks.motion_capture`, and standing still; with --clips the shared clips
instead.  acceleration: mean length of the difference of the joints' accelerations to the truth.  lag: delay that
maximises the correlation of the joints' velocities with the truth's.  still, step: RMS turn of the joints about their
mean, and from frame to frame, while the person stands.  Means over takes, the worst in brackets.  All variants have the
body of the end of the take, as exports.
"""

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, nan
from multiprocessing import Pool

import cv2
import numba
import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.clips import SHARED
from benchmarks.hybrid.accuracy import VIEWS
from benchmarks.hybrid.bench import Places, clip_of
from benchmarks.hybrid.both_ways import both_ways_path
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import ANATOMY, NAMES, Case, Film, setup_of, track_clip
from benchmarks.motion_capture import FPS, MOTIONS, PRIOR, Shot
from benchmarks.motion_capture import clip_of as captured_clip
from benchmarks.simulated_clip import RINGS, SIZE, simulated_clip
from benchmarks.table import Cell, table
from benchmarks.takes import default_folder
from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.joint_rotations import joint_rotations
from zenocap.common.body.one_euro import Filtered, OneEuro, filtered
from zenocap.common.formats.pose_track import Bound, PoseTrack
from zenocap.common.formats.smoothing import DEFAULT_HZ, smoothed
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.prior.file import find_prior, read_prior
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import interpolate, minimum_jerk, neutral
from zenocap.simulation.motion.timeline import t_pose
from zenocap.tools.recordings.evaluate import ScoredFrames, accuracy

STANDING = "standing"
EMPTY_S, T_POSE_S, LOWERING_S, SETTLING_S, STILL_S = 1.0, 1.5, 0.6, 1.0, 4.0
MAX_LAG = 8  # frames
VARIANTS = ("as tracked", "one-euro (live)", f"{DEFAULT_HZ:g} Hz", "both ways", f"both ways, {DEFAULT_HZ:g} Hz")


@dataclass(frozen=True)
class Figures:
    """acceleration: m/s^2.  error, shape: mm, see `Run`.  lost: %.  lag: ms.  still, step: degrees, NaN in motion."""

    acceleration: float
    error: float
    shape: float
    lost: float
    lag: float
    still: float
    step: float


def standing_clip(shot: Shot) -> Film:
    """Empty scene, T-pose, arms down, then standing still; scored a second after the arms are down."""
    subject = person(shot.person)
    stretched, standing = t_pose(subject), neutral(subject)
    steps = ceil(LOWERING_S * FPS)
    lowering = [interpolate(stretched, standing, minimum_jerk(k / steps)) for k in range(1, steps + 1)]
    opening = [None] * ceil(EMPTY_S * FPS) + [stretched] * ceil(T_POSE_S * FPS) + lowering
    first = len(opening) + ceil(SETTLING_S * FPS)
    poses = [*opening, *[standing] * ceil((SETTLING_S + STILL_S) * FPS)]
    return simulated_clip(STANDING, subject, poses, first, FPS, shot.views)


def shared_clip(name: str, views: int) -> tuple[Film, Case]:
    """A shared clip with some of its views, and how it is tracked."""
    places = Places(SHARED / "clips", SHARED / "motions", default_folder() / "hybrid")
    chosen = VIEWS.get(str(views), ()) if name[-1] == "7" else ()
    return clip_of(places, name), Case(name, views=chosen, prior=KINDS.get(name, PRIOR))


def figures(job: tuple[Shot | None, str, int, int]) -> tuple[Figures, ...]:
    """Figures of each of VARIANTS.  job: a shot, or None and a shared clip with a number of views; random seed."""
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
    shot, name, views, seed = job
    if shot is None:
        clip, case = shared_clip(name, views)
        case = Case(case.clip, seed, case.views, case.prior)
    else:
        clip = standing_clip(shot) if shot.motion == STANDING else captured_clip(shot)
        case = Case("", seed, prior=PRIOR)
    forward, both = tracks(clip, case)
    if forward is None or both is None:
        return (Figures(nan, nan, nan, 100.0, nan, nan, nan),) * len(VARIANTS)
    variants = (forward, live(forward), smoothed(forward, DEFAULT_HZ), both, smoothed(both, DEFAULT_HZ))
    return tuple(_figures(one, clip, still=shot is not None and shot.motion == STANDING) for one in variants)


def tracks(clip: Film, case: Case) -> tuple[PoseTrack | None, PoseTrack | None]:
    """Poses of the forward pass and of both ways, with the last body; None when the person was never tracked."""
    prior = read_prior(find_prior(case.prior)) if case.prior else None
    forward = track_clip(clip, case, prior)
    if not forward.poses:
        return None, None
    both = both_ways_path(clip, setup_of(clip, case, prior), forward)
    body, _ = forward.poses[max(forward.poses)]
    frames = [frame for frame in forward.wall_ms if frame >= min(forward.poses)]
    poses = [[path.poses[frame][1] if frame in path.poses else None for frame in frames] for path in (forward, both)]
    return _track(body, frames, poses[0], clip.truth.rate), _track(body, frames, poses[1], clip.truth.rate)


def _track(body: Bdp, frames: Sequence[int], poses: Sequence[Pose | None], rate: float) -> PoseTrack:
    positions = np.array([np.full(3, nan) if pose is None else pose.position for pose in poses])
    angles = np.array([np.full(len(ANATOMY.angles), nan) if pose is None else pose.angles for pose in poses])
    lost = tuple("person" if pose is None else "" for pose in poses)
    numbers = np.array(frames, dtype=np.int64)
    return PoseTrack(ANATOMY, body, numbers, numbers / rate, positions, angles, {}, {}, lost, rate)


def live(track: PoseTrack) -> PoseTrack:
    """The track smoothed pose by pose, as the animator does."""
    last: Filtered | None = None
    poses: list[Pose | None] = []
    for row, time_s in enumerate(track.times_s):
        if track.lost[row]:
            last = None
            poses.append(None)
        else:
            last, pose = filtered(ANATOMY, OneEuro(), last, round(1e9 * time_s), track.pose(row))
            poses.append(pose)
    return _track(track.bdp, track.frames.tolist(), poses, track.rate)


def _figures(track: PoseTrack, clip: Film, still: bool) -> Figures:
    truth, rate = clip.truth, clip.truth.rate
    joints = track.trajectories()
    found, names = np.full((len(truth.frames), len(NAMES), 3), nan), [name for name in NAMES if name in truth.names]
    rows = {int(frame): k for k, frame in enumerate(joints.frames)}
    for k, frame in enumerate(truth.frames):
        if int(frame) in rows:
            found[k] = joints.points[rows[int(frame)]]
    scored = truth.frames >= clip.motion_from
    found = found[scored][:, [NAMES.index(name) for name in names]]
    exact = truth.points[scored][:, [truth.names.index(name) for name in names]]
    accelerations = np.linalg.norm(np.diff(found - exact, 2, axis=0), axis=-1) * rate**2
    known = joints.points[~np.isnan(joints.points[:, 0, 0])]
    if not np.isfinite(accelerations).any() or not len(known):
        return Figures(nan, nan, nan, 100.0, nan, nan, nan)
    kept = ~np.isnan(joints.points[:, 0, 0])
    estimate = Trajectories(joints.names, joints.frames[kept], joints.times_s[kept], joints.points[kept], rate)
    score = accuracy(estimate, truth, ScoredFrames(first=Bound(clip.motion_from)))
    return Figures(
        float(np.nanmean(accelerations)),
        score.mpjpe_mm,
        score.shape_mm,
        score.lost_pct,
        nan if still else 1e3 * lag_s(found, exact, rate),
        *(jitter_deg(track, clip.motion_from) if still else (nan, nan)),
    )


def lag_s(found: Floats, exact: Floats, rate: float) -> float:
    """Delay (s) of joints (n, joints, 3) with the greatest correlation of velocities; between frames by a parabola."""
    moved, expected = np.diff(found, axis=0), np.diff(exact, axis=0)
    known = np.flatnonzero(~np.isnan(moved[:, 0, 0]))
    times: Ints = known[(known >= MAX_LAG) & (known < len(moved) - MAX_LAG)]
    correlations = []
    for lag in range(-MAX_LAG, MAX_LAG + 1):
        one, other = moved[times].ravel(), expected[times - lag].ravel()
        correlations.append(float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other)))
    best = int(np.clip(np.argmax(correlations), 1, 2 * MAX_LAG - 1))
    left, middle, right = correlations[best - 1 : best + 2]
    return (best - MAX_LAG + 0.5 * (left - right) / (left - 2.0 * middle + right)) / rate


def jitter_deg(track: PoseTrack, first: int) -> tuple[float, float]:
    """RMS turn of all joints and the root about their mean, and from frame to frame, degrees, from frame `first` on."""
    rows = track.known & (track.frames >= first)
    rotations = joint_rotations(ANATOMY, track.positions[rows], track.angles[rows])
    squares, steps = [], []
    for ball in range(rotations.quaternions.shape[1]):
        turns = Rotation.from_quat(rotations.quaternions[:, ball])
        squares.append(np.mean((turns.mean().inv() * turns).magnitude() ** 2))
        steps.append(np.mean((turns[:-1].inv() * turns[1:]).magnitude() ** 2))
    squares += [np.var(hinge) for hinge in rotations.hinges.T]
    steps += [np.mean(np.diff(hinge) ** 2) for hinge in rotations.hinges.T]
    return float(np.degrees(np.sqrt(np.mean(squares)))), float(np.degrees(np.sqrt(np.mean(steps))))


def _rows(title: str, results: Sequence[tuple[Figures, ...]]) -> list[list[Cell]]:
    rows: list[list[Cell]] = []
    for k, variant in enumerate(VARIANTS):
        cells = [_mean(getattr(one[k], key) for one in results) for key in Figures.__dataclass_fields__]
        rows.append([f"{title}: {variant}", *cells])
        print("  ".join(str(cell) for cell in rows[-1]), flush=True)
    return rows


def _mean(values: Iterable[float]) -> str:
    known = [value for value in values if np.isfinite(value)]
    return f"{np.mean(known):.2f} ({np.max(known):.2f})" if known else "-"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", type=int, nargs="+", choices=tuple(RINGS), default=[2, 4])
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--first-person", type=int, default=108)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--motions", nargs="+", choices=MOTIONS, default=MOTIONS, metavar="NAME")
    parser.add_argument("--clips", nargs="+", default=[], metavar="NAME", help="shared clips, with the first of --views")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    needed = [SHARED / "clips" / name for name in options.clips]
    needed += [] if options.clips else [SHARED / "motions" / f"cmu_{name}.bvh" for name in options.motions]
    if missing := [str(path) for path in needed if not path.exists()]:
        print(f"jitter: skipped: {', '.join(missing)} missing (expected beside the checkout)")
        return
    seeds, rows = range(options.seeds), list[list[Cell]]()
    people = range(options.first_person, options.first_person + options.people)
    with Pool(options.jobs) as pool:
        for name in options.clips:
            jobs: list[tuple[Shot | None, str, int, int]] = [(None, name, options.views[0], seed) for seed in seeds]
            rows += _rows(name, pool.map(figures, jobs, chunksize=1))
        for views in () if options.clips else options.views:
            for title, motions in (("motion", options.motions), (STANDING, (STANDING,))):
                shots = [Shot(who, motion, views) for who in people for motion in motions]
                jobs = [(shot, "", views, seed) for shot in shots for seed in seeds]
                rows += _rows(f"{views} views, {title}", pool.map(figures, jobs, chunksize=1))
    columns = ("poses", "acceleration m/s^2", "error mm", "shape mm", "lost %", "lag ms", "still deg", "step deg")
    print(table(f"Jitter, frames of {SIZE[0]} x {SIZE[1]} or of the clips; the worst take in brackets", columns, rows))


if __name__ == "__main__":
    main()
