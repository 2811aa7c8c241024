"""One run of the tracker over a clip's silhouettes, and its figures."""

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, replace
from typing import Protocol, Self
from unittest.mock import patch

import numpy as np

from benchmarks.hybrid.silhouettes import Instant
from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.rig.tracker import ITERATIONS, PRESETS
from zenocap.services.tracker.filter import filter_step
from zenocap.services.tracker.filter.particles import Refinement
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.states import Method, Options, Setup
from zenocap.services.tracker.tracking import describe, initial_state, track
from zenocap.tools.recordings.evaluate import ScoredFrames, accuracy

ANATOMY = FOURTEEN_PARTS
NAMES = tuple(marker.name for marker in ANATOMY.markers)
FRACTIONS = ("PRIOR_FRACTION", "MIN_PRIOR_FRACTION", "MAX_PRIOR_FRACTION")


class Film(Protocol):
    """What the tracker and its errors need of a clip; see `Clip`."""

    @property
    def cameras(self) -> Mapping[str, Camera]: ...
    @property
    def instants(self) -> tuple[Instant, ...]: ...
    @property
    def truth(self) -> Trajectories: ...
    @property
    def motion_from(self) -> int: ...
    @property
    def frame_ns(self) -> int: ...
    def masks(self, instant: Instant, views: Mapping[str, Camera], /) -> dict[str, Mask]: ...
    def of_views(self, views: Sequence[str], /) -> Self: ...


@dataclass(frozen=True)
class Case:
    """One configuration.  views: none for all.  prior: as in `priors.Priors.path`; none without one.

    share: fixed fraction of the proposals from the prior; None to adapt.  empty_from: first of `empty_frames` frames with
    all views empty.  skipped: frames of the motion not scored, because the prior was trained on them.
    preset: gives anatomy and filter.  size: working size (width, height) px; None for the clip's own.  t_pose: whether the
    separate video of the T-pose is shown, where a clip has one.  height: of the person, metres, instead of a measured body.
    both_ways: scored are the poses of `zenocap track --both-ways`.
    """

    clip: str
    seed: int = 0
    views: tuple[str, ...] = ()
    prior: str = ""
    method: Method = "hybrid"
    particles: int = 40
    points: int = 400
    iterations: int = ITERATIONS["gauss-newton"]
    refinement: Refinement = "gauss-newton"
    share: float | None = None
    empty_from: int | None = None
    empty_frames: int = 10
    skipped: int = 0
    preset: str = "default"
    size: tuple[int, int] | None = None
    t_pose: bool = True
    height: float | None = None
    both_ways: bool = False

    @property
    def anatomy(self) -> Anatomy:
        """Anatomy of the tracked body."""
        return ANATOMIES[PRESETS[self.preset].anatomy]


@dataclass(frozen=True)
class Run:
    """mean, rmse, shape, median: millimetres, as in `score_trc.py`.  lost_pct: of the ground truth's joints.

    losses: number of track losses in the scored part.  started: frame of the first pose; -1 for none.  wall_ms, cpu_ms:
    median of a scored frame.  load: of the machine.  errors: mean over the joints by scored frame, mm.  first: frame of
    errors[0].  centres_mm: joint centres by scored frame, (15 NAMES x, y, z) in a row; empty without a pose.
    angles: joint angles by scored frame, radians, ordered by `Anatomy.angles`; empty without a pose.
    before_mm: median error of the frames before the scored ones.  ended: state after the last frame, in words.
    """

    mean_mm: float
    rmse_mm: float
    shape_mm: float
    median_mm: float
    lost_pct: float
    per_joint_mm: dict[str, float]
    losses: int
    started: int
    wall_ms: float
    cpu_ms: float
    load: float
    first: int
    errors: tuple[float, ...]
    centres_mm: tuple[tuple[float, ...], ...] = ()
    angles: tuple[tuple[float, ...], ...] = ()
    before_mm: float = float("nan")
    ended: str = ""

    def plain(self) -> dict[str, object]:
        return asdict(self)


@dataclass(frozen=True)
class TrackedPath:
    """poses: by frame, with the body of that frame.  lost: frames of track loss.

    wall_ms, cpu_ms: by frame.  anatomy: of the poses.  views: used ones, by frame.  ended: see `Run`.
    """

    poses: dict[int, tuple[Bdp, Pose]]
    lost: tuple[int, ...]
    wall_ms: dict[int, float]
    cpu_ms: dict[int, float]
    anatomy: Anatomy = ANATOMY
    views: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    ended: str = ""


def setup_of(clip: Film, case: Case, prior: Prior | None) -> Setup:
    options = Options(
        method=case.method, particles=case.particles, points=case.points, iterations=case.iterations, seed=case.seed,
        refinement=case.refinement, filter=PRESETS[case.preset].filter,
    )  # fmt: skip
    return Setup(case.anatomy, clip.of_views(case.views).cameras, clip.frame_ns, prior, options, case.height)


def track_clip(clip: Film, case: Case, prior: Prior | None) -> TrackedPath:
    """Track every frame set of the clip."""
    setup = setup_of(clip, case, prior)
    gap = range(0) if case.empty_from is None else range(case.empty_from, case.empty_from + case.empty_frames)
    poses: dict[int, tuple[Bdp, Pose]] = {}
    lost: list[int] = []
    wall: dict[int, float] = {}
    cpu: dict[int, float] = {}
    views: dict[int, tuple[str, ...]] = {}
    body: Bdp | None = None
    with fixed_prior_fraction(case.share):
        state, was_lost = initial_state(setup), False
        for instant in clip.instants:
            masks = clip.masks(instant, setup.cameras)
            if instant.captured_ns >= 0 and instant.frame in gap:
                masks = {view: np.zeros_like(mask) for view, mask in masks.items()}
            wall_s, cpu_s = time.perf_counter(), time.process_time()
            state, outcome = track(setup, state, instant.captured_ns, masks)
            wall_s, cpu_s = time.perf_counter() - wall_s, time.process_time() - cpu_s
            body = body if outcome.body is None else outcome.body
            if instant.captured_ns < 0:
                continue
            wall[instant.frame], cpu[instant.frame] = 1e3 * wall_s, 1e3 * cpu_s
            views[instant.frame] = outcome.views
            if outcome.pose is not None and body is not None:
                poses[instant.frame] = body, outcome.pose
            if outcome.lost and not was_lost:
                lost.append(instant.frame)
            was_lost = outcome.lost
    return TrackedPath(poses, tuple(lost), wall, cpu, case.anatomy, views, describe(state))


def run(clip: Film, case: Case, prior: Prior | None) -> Run:
    """Track the person, and score the result."""
    path = track_clip(clip, case, prior)
    return scored(path, clip.truth, clip.motion_from + case.skipped)


def scored(path: TrackedPath, truth: Trajectories, first: int) -> Run:
    """Figures of a path from frame `first` on; without a pose everything is lost."""
    nan = float("nan")
    load = os.getloadavg()[0]
    timed = [frame for frame in path.wall_ms if frame >= first]
    wall = float(np.median([path.wall_ms[frame] for frame in timed])) if timed else nan
    cpu = float(np.median([path.cpu_ms[frame] for frame in timed])) if timed else nan
    losses = sum(frame >= first for frame in path.lost)
    if not any(frame >= first for frame in path.poses):
        started = min(path.poses, default=-1)
        return Run(
            nan, nan, nan, nan, 100.0, {}, max(1, losses), started, wall, cpu, load, first, (), ended=path.ended
        )  # fmt: skip
    track = trajectories(path, truth)
    found = accuracy(track, truth, ScoredFrames(first=Bound(first)))
    frames, errors = frame_errors(track, truth)
    kept = frames >= first
    before = errors[~kept & np.isfinite(errors)]
    return Run(
        found.mpjpe_mm, found.rmse_mm, found.shape_mm, found.median_mm, found.lost_pct, found.per_joint_mm, losses,
        min(path.poses), wall, cpu, load, int(frames[kept][0]), tuple(round(float(e), 3) for e in errors[kept]),
        _centres_mm(track, frames[kept]), _angles(path, frames[kept]), float(np.median(before)) if len(before) else nan,
        path.ended,
    )  # fmt: skip


def trajectories(path: TrackedPath, truth: Trajectories) -> Trajectories:
    """Joint centres of the path, metres."""
    frames = np.array(sorted(path.poses), dtype=np.int64)
    points = np.array([joint_centres(path.anatomy, *path.poses[int(frame)]) for frame in frames])
    return Trajectories(NAMES, frames, frames / truth.rate, points, truth.rate)


def _centres_mm(track: Trajectories, frames: Ints) -> tuple[tuple[float, ...], ...]:
    """See Run."""
    rows = {int(frame): k for k, frame in enumerate(track.frames)}
    values = np.round(1e3 * track.points, 1).reshape(len(track.points), -1)
    return tuple(tuple(map(float, values[rows[int(frame)]])) if int(frame) in rows else () for frame in frames)


def _angles(path: TrackedPath, frames: Ints) -> tuple[tuple[float, ...], ...]:
    """See Run."""
    found = [path.poses.get(int(frame)) for frame in frames]
    return tuple(() if one is None else tuple(np.round(one[1].angles, 4).tolist()) for one in found)


def run_trajectories(run: Run, rate: float) -> Trajectories:
    """Joint centres of the scored frames with a pose, metres.  rate: frames per second.  Raises ValueError without any."""
    known = [k for k, row in enumerate(run.centres_mm) if row]
    if not known:
        raise ValueError("run without a pose: allowed: one or more frames with joint centres")
    frames = run.first + np.array(known, dtype=np.int64)
    points = 1e-3 * np.array([run.centres_mm[k] for k in known]).reshape(len(known), len(NAMES), 3)
    return Trajectories(NAMES, frames, frames / rate, points, rate)


def frame_errors(track: Trajectories, truth: Trajectories) -> tuple[Ints, Floats]:
    """Frames of the ground truth, and the mean distance over the joints in each, millimetres; NaN without a pose."""
    names = [name for name in truth.names if name in track.names]
    expected = truth.points[:, [truth.names.index(name) for name in names]]
    found = np.full_like(expected, np.nan)
    rows = {int(frame): k for k, frame in enumerate(track.frames)}
    for k, frame in enumerate(truth.frames):
        if int(frame) in rows:
            found[k] = track.points[rows[int(frame)]][[track.names.index(name) for name in names]]
    errors: Floats = 1e3 * np.linalg.norm(found - expected, axis=2).mean(axis=1)
    return truth.frames, errors


@contextmanager
def fixed_prior_fraction(share: float | None) -> Iterator[None]:
    """Fix the fraction of proposals from the prior inside the context; None: it adapts."""
    with ExitStack() as stack:
        if share is not None:
            for name in FRACTIONS:
                stack.enter_context(patch.object(filter_step, name, share))
        yield


def of_seed(case: Case, seed: int) -> Case:
    return replace(case, seed=seed)
