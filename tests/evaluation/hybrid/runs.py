"""One run of the tracking core over a clip's silhouettes, and its figures."""

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import FOURTEEN_PARTS, Floats
from common.body.definition import Bdp, Pose
from common.body.kinematics import joint_centres
from common.formats.trc import Trajectories
from common.runtime.tracker_table import ITERATIONS
from services.takes.evaluate import Selection, accuracy
from services.tracker import filtering
from services.tracker.phases import Method, Options, Refinement, Setup
from services.tracker.prior.model import Prior
from services.tracker.tracking import follow, initial_state
from tests.evaluation.hybrid.silhouettes import Clip

ANATOMY = FOURTEEN_PARTS
NAMES = tuple(marker.name for marker in ANATOMY.markers)
SHARES = ("PRIOR_SHARE", "LEAST_SHARE", "MOST_SHARE")


@dataclass(frozen=True)
class Case:
    """What is run.  views: none for all.  prior: as `priors.Priors.path` has it; none without one.

    share: of the proposals that come from the prior, fixed; None to adapt.  empty_from: the first of `empty_frames` in
    which no view sees anything.  skipped: frames of the motion that are not scored, because the prior was learnt from them.
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


@dataclass(frozen=True)
class Run:
    """mean, rmse, shape, median: millimetres, as `score_trc.py` has them.  lost_pct: of the truth's joints.

    losses: how often the person was lost in what is scored.  started: frame of the first pose; -1 for none ever.
    wall_ms, cpu_ms: median of a scored frame.  load: of the machine.  errors: mean over the joints by scored frame, mm.
    first: the frame of errors[0].
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

    def plain(self) -> dict[str, object]:
        return asdict(self)


@dataclass(frozen=True)
class Followed:
    """poses: by frame, with the body of that time.  lost: frames in which the person newly was lost.

    wall_ms, cpu_ms: by frame.
    """

    poses: dict[int, tuple[Bdp, Pose]]
    lost: tuple[int, ...]
    wall_ms: dict[int, float]
    cpu_ms: dict[int, float]


def setup_of(clip: Clip, case: Case, prior: Prior | None) -> Setup:
    options = Options(
        method=case.method, particles=case.particles, points=case.points, iterations=case.iterations, seed=case.seed,
        refinement=case.refinement,
    )  # fmt: skip
    return Setup(ANATOMY, clip.of_views(case.views).cameras, clip.frame_ns, prior, options)


def followed(clip: Clip, case: Case, prior: Prior | None) -> Followed:
    """The core over every instant of the clip."""
    setup = setup_of(clip, case, prior)
    gap = range(0) if case.empty_from is None else range(case.empty_from, case.empty_from + case.empty_frames)
    poses: dict[int, tuple[Bdp, Pose]] = {}
    lost: list[int] = []
    wall: dict[int, float] = {}
    cpu: dict[int, float] = {}
    body: Bdp | None = None
    with held_share(case.share):
        state, was_lost = initial_state(setup), False
        for instant in clip.instants:
            masks = clip.masks(instant, setup.cameras)
            if instant.captured_ns >= 0 and instant.frame in gap:
                masks = {view: np.zeros_like(mask) for view, mask in masks.items()}
            wall_s, cpu_s = time.perf_counter(), time.process_time()
            state, outcome = follow(setup, state, instant.captured_ns, masks)
            wall_s, cpu_s = time.perf_counter() - wall_s, time.process_time() - cpu_s
            body = body if outcome.body is None else outcome.body
            if instant.captured_ns < 0:
                continue
            wall[instant.frame], cpu[instant.frame] = 1e3 * wall_s, 1e3 * cpu_s
            if outcome.pose is not None and body is not None:
                poses[instant.frame] = body, outcome.pose
            if outcome.lost and not was_lost:
                lost.append(instant.frame)
            was_lost = outcome.lost
    return Followed(poses, tuple(lost), wall, cpu)


def run(clip: Clip, case: Case, prior: Prior | None) -> Run:
    """Follow the person, and score it."""
    path = followed(clip, case, prior)
    return scored(path, clip.truth, clip.motion_from + case.skipped)


def scored(path: Followed, truth: Trajectories, first: int) -> Run:
    """Figures of a path from frame `first` on; everything is lost and nothing else known where there is no pose."""
    nan = float("nan")
    load = os.getloadavg()[0]
    timed = [frame for frame in path.wall_ms if frame >= first]
    wall = float(np.median([path.wall_ms[frame] for frame in timed])) if timed else nan
    cpu = float(np.median([path.cpu_ms[frame] for frame in timed])) if timed else nan
    losses = sum(frame >= first for frame in path.lost)
    if not any(frame >= first for frame in path.poses):
        return Run(nan, nan, nan, nan, 100.0, {}, max(1, losses), min(path.poses, default=-1), wall, cpu, load, first, ())
    track = trajectories(path, truth)
    found = accuracy(track, truth, Selection(first=first))
    frames, errors = frame_errors(track, truth)
    kept = frames >= first
    return Run(
        found.mpjpe_mm, found.rmse_mm, found.shape_mm, found.median_mm, found.lost_pct, found.per_joint_mm, losses,
        min(path.poses), wall, cpu, load, int(frames[kept][0]), tuple(round(float(e), 3) for e in errors[kept]),
    )  # fmt: skip


def trajectories(path: Followed, truth: Trajectories) -> Trajectories:
    """Joint centres of the path, metres."""
    frames = np.array(sorted(path.poses), dtype=np.int64)
    points = np.array([joint_centres(ANATOMY, *path.poses[int(frame)]) for frame in frames])
    return Trajectories(NAMES, frames, frames / truth.rate, points, truth.rate)


def frame_errors(track: Trajectories, truth: Trajectories) -> tuple[NDArray[np.int64], Floats]:
    """The truth's frames, and the mean distance over the joints in each, millimetres; NaN where there is no pose."""
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
def held_share(share: float | None) -> Iterator[None]:
    """The prior's share of the proposals is held while this is open; None: it adapts as ever."""
    with ExitStack() as stack:
        if share is not None:
            for name in SHARES:
                stack.enter_context(patch.object(filtering, name, share))
        yield


def of_seed(case: Case, seed: int) -> Case:
    return replace(case, seed=seed)
