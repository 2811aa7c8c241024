"""The tracker over a clip's silhouettes, in one direction or both, and its errors."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.people.shared_clips import Instant
from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.clinical_angles import clinical_angles, joint_rotations
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.angle_series import AngleSeries, angle_series
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.both_ways.passes import ForwardPose, SceneMasks, two_passes
from zenocap.services.tracker.filter.confidence import Confidence, confidences
from zenocap.services.tracker.states import AwaitingPerson, TrackerSetup, TrackState
from zenocap.services.tracker.tracking import initial_state, track
from zenocap.tools.takes.evaluate import ScoredFrames, accuracy
from zenocap.tools.takes.evaluate_angles import AngleError, compared

ANATOMY = FOURTEEN_PARTS
NAMES = tuple(marker.name for marker in ANATOMY.markers)


class PersonClip(Protocol):
    """Silhouettes and truth of one person: a shared clip or a simulated one.  motion_from: first scored frame."""

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


@dataclass(frozen=True)
class TrackedPath:
    """poses: by frame, with the body of that frame.  lost: frames in which the track was lost.  views: used, by frame.

    confidence: of the poses, by frame.
    """

    poses: dict[int, tuple[Bdp, Pose]]
    lost: tuple[int, ...] = ()
    anatomy: Anatomy = ANATOMY
    views: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    confidence: Mapping[int, Confidence] = field(default_factory=dict)

    @property
    def body(self) -> Bdp:
        """The last body."""
        return self.poses[max(self.poses)][0]


def track_clip(
    clip: PersonClip, setup: TrackerSetup, empty: range = range(0), state: TrackState | None = None
) -> TrackedPath:
    """Track every frame set of the clip.  empty: frames in which all views are empty.  state: the first one."""
    poses: dict[int, tuple[Bdp, Pose]] = {}
    lost: list[int] = []
    views: dict[int, tuple[str, ...]] = {}
    confidence: dict[int, Confidence] = {}
    state, was_lost = state or initial_state(setup), False
    body = None if isinstance(state.phase, AwaitingPerson) else state.phase.person.body
    for instant in clip.instants:
        masks = clip.masks(instant, setup.cameras)
        if instant.captured_ns >= 0 and instant.frame in empty:
            masks = {view: np.zeros_like(mask) for view, mask in masks.items()}
        state, outcome = track(setup, state, instant.captured_ns, masks)
        body = body if outcome.body is None else outcome.body
        if instant.captured_ns < 0:
            continue
        views[instant.frame] = outcome.views
        if outcome.pose is not None and body is not None:
            poses[instant.frame] = body, outcome.pose
            confidence[instant.frame] = confidences(outcome.limb_features, outcome.toes, outcome.against)
        if outcome.lost and not was_lost:
            lost.append(instant.frame)
        was_lost = outcome.lost
    return TrackedPath(poses, tuple(lost), setup.anatomy, views, confidence)


def both_ways(clip: PersonClip, setup: TrackerSetup, path: TrackedPath) -> TrackedPath:
    """The poses of both directions, all with the last body.  path: of the forward pass, of all instants."""
    if not path.poses:
        return path
    body, pose = path.poses[max(path.poses)]
    instants = [one for one in clip.instants if one.captured_ns >= 0 and one.frame >= min(path.poses)]
    forward: list[ForwardPose] = []
    for instant in instants:
        lost = instant.frame not in path.poses
        pose = pose if lost else path.poses[instant.frame][1]
        stated = path.confidence.get(instant.frame)
        forward.append(ForwardPose(instant.captured_ns, pose, lost, path.views[instant.frame], stated))
    last = max(k for k, one in enumerate(forward) if not one.lost)

    def backwards() -> Iterator[SceneMasks]:
        for one, instant in zip(forward[last::-1], instants[last::-1], strict=True):
            masks = clip.masks(instant, setup.cameras)
            yield one, {viewer: masks[viewer] for viewer in setup.cameras if viewer in one.views}

    found = two_passes(setup, body, forward, backwards())
    poses = {
        instant.frame: (body, found[instant.captured_ns].pose)
        for instant in instants
        if not found[instant.captured_ns].lost
    }
    return replace(path, poses=poses)


def errors(path: TrackedPath, truth: Trajectories, first: int) -> dict[str, float]:
    """Figures from frame `first` on, mm and %, as `score_trc.py` has them; without a pose everything is lost.

    shape: RMSE without each joint's constant offset.  lost: joints without an estimate or more than 250 mm off.
    """
    losses = sum(frame >= first for frame in path.lost)
    start = {"first pose": float(min(path.poses))} if path.poses else {}
    if not any(frame >= first for frame in path.poses):
        return start | {"lost": 100.0, "losses": max(1, losses)}
    found = accuracy(trajectories(path, truth.rate), truth, ScoredFrames(first=Bound(first)))
    return start | {
        "mean": found.mpjpe_mm,
        "RMSE": found.rmse_mm,
        "shape": found.shape_mm,
        "lost": found.lost_pct,
        "losses": losses,
    }


def trajectories(path: TrackedPath, rate: float, first: int = 0) -> Trajectories:
    """Joint centres of the path from frame `first` on, metres.  rate: frames per second.  Raises ValueError without any."""
    frames = np.array([frame for frame in sorted(path.poses) if frame >= first], dtype=np.int64)
    if not len(frames):
        raise ValueError(f"path without a pose from frame {first} on: allowed: one or more")
    points = np.array([joint_centres(path.anatomy, *path.poses[int(frame)]) for frame in frames])
    return Trajectories(NAMES, frames, frames / rate, points, rate)


def frame_errors(path: TrackedPath, truth: Trajectories) -> tuple[Ints, Floats]:
    """Frames of the truth, and the mean distance over the joints in each, millimetres; NaN without a pose."""
    distances = 1e3 * np.linalg.norm(offsets(path, truth), axis=2)
    return truth.frames, distances.mean(axis=1)


def offsets(path: TrackedPath, truth: Trajectories) -> Floats:
    """(frames, joints, 3) estimated less true joint centres of the truth's frames, metres; NaN without a pose."""
    columns = [NAMES.index(name) for name in truth.names if name in NAMES]
    expected = truth.points[:, [k for k, name in enumerate(truth.names) if name in NAMES]]
    found = np.full_like(expected, np.nan)
    for k, frame in enumerate(truth.frames):
        if int(frame) in path.poses:
            found[k] = joint_centres(path.anatomy, *path.poses[int(frame)])[columns]
    return found - expected


def centre_angles(centres: Trajectories) -> AngleSeries:
    """Joint angles of joint centres, with a trunk of one part."""
    return angle_series(centres, Path("centres"), rigid_trunk=True)


def pose_angles(path: TrackedPath, rate: float, first: int) -> AngleSeries:
    """Joint angles of the poses from frame `first` on."""
    frames = np.arange(first, max(path.poses) + 1, dtype=np.int64)
    known = np.array([int(frame) in path.poses for frame in frames])
    unknown = np.full(len(path.anatomy.angles), np.nan)
    values = np.array([path.poses[int(k)][1].angles if int(k) in path.poses else unknown for k in frames])
    return AngleSeries(frames, frames / rate, known, clinical_angles(joint_rotations(path.anatomy, values)), rate)


def angle_errors(estimate: AngleSeries, truth: AngleSeries, first: int) -> Mapping[str, AngleError]:
    """Errors by the name of the angle from frame `first` on."""
    names = Path("estimate"), Path("truth")  # for errors
    return compared(estimate, truth, ScoredFrames(first=Bound(first)), *names)[0].angles


def of_sides(found: Mapping[str, AngleError], name: str) -> tuple[float, float]:
    """RMS, and RMS without each side's constant offset, over both sides, degrees; NaN where neither is compared."""
    sides = [found[f"{name}_{letter}"] for letter in "rl" if f"{name}_{letter}" in found]
    if not sides:
        return float("nan"), float("nan")
    squares = np.array([(one.rms_deg**2, one.rms_unbiased_deg**2) for one in sides])
    rms, unbiased = np.sqrt(np.average(squares, axis=0, weights=[one.frames for one in sides]))
    return float(rms), float(unbiased)


def frames_until(frames: Ints, distances: Floats, seen: int, below_mm: float, in_row: int = 1) -> float:
    """Frames from `seen` on until the error is below `below_mm`, 1 for `seen` itself; NaN for never.

    in_row: number of consecutive frames below, of which the first counts.
    """
    below = distances[frames >= seen] < below_mm
    recovered = [k for k in range(len(below) - in_row + 1) if below[k : k + in_row].all()]
    return recovered[0] + 1.0 if recovered else float("nan")
