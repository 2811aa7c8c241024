"""Poses of a take, from the two-view method or the tracker, as arrays of the human model."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.joint_conventions import Convention
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import Bap, anatomy_of, bdp_of, is_lost, lost_parts, pose_of
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack, rate_of
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE, VIDEO_NOTES, read_setup
from zenocap.common.topics import BOTH_WAYS_POSE, CAMERA, TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP

NO_VIEW = ("", np.nan)
TOPICS_USED = (CAMERA, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE, BOTH_WAYS_POSE)
USED_ROLE = "used"  # role of a view in the tracker
Kept = TypeVar("Kept")


@dataclass(frozen=True)
class TakePoses:
    """Body, poses and cameras of a take.

    baps: in the order of their capture times, one each.  bdp: the last one.  start_ns: capture time of frame 0.
    cameras: by viewer.  cut: description of the damage, None for an intact file.  measured: whether the body was measured
    in a T-pose; another one has average proportions.  video_notes: by viewer, see `VideoSummary`.
    """

    path: Path
    anatomy: Anatomy
    bdp: Bdp
    baps: tuple[Bap, ...]
    start_ns: int
    cameras: dict[str, m.CameraInfo]
    cut: str | None
    measured: bool = True
    video_notes: Mapping[str, str] = field(default_factory=dict)

    def pose(self, bap: Bap) -> Pose:
        """Pose of one of `baps`, as arrays."""
        return pose_of(self.anatomy, bap)

    @property
    def frames(self) -> Ints:
        """Frame numbers (n,) of `baps`, see `rising_frames`."""
        return rising_frames(np.array([bap.frame for bap in self.baps], dtype=np.int64), self.times_s)

    @property
    def times_s(self) -> Floats:
        """Capture times (n,) of `baps`, seconds since frame 0."""
        return np.array([(bap.captured_ns - self.start_ns) / 1e9 for bap in self.baps])

    def rate(self) -> float:
        """Frames per second."""
        return rate_of(self.frames, self.times_s)

    def track(self) -> PoseTrack:
        """Return the poses as arrays."""
        views = [views_of(bap) for bap in self.baps]
        viewers = sorted({viewer for view in views for viewer in view} | set(self.cameras))
        positions = np.full((len(self.baps), 3), np.nan)
        angles = np.full((len(self.baps), len(self.anatomy.angles)), np.nan)
        for row, bap in enumerate(self.baps):
            if not is_lost(bap):
                pose = self.pose(bap)
                positions[row], angles[row] = pose.position, pose.angles
        return PoseTrack(
            anatomy=self.anatomy,
            bdp=self.bdp,
            frames=self.frames,
            times_s=self.times_s,
            positions=positions,
            angles=angles,
            scores={viewer: np.array([view.get(viewer, NO_VIEW)[1] for view in views]) for viewer in viewers},
            views={viewer: tuple(view.get(viewer, NO_VIEW)[0] for view in views) for viewer in viewers},
            lost=tuple(" ".join(lost_parts(bap)) for bap in self.baps),
            rate=self.rate(),
            limbs=limbs_of(self.baps),
        )

    def trajectories(self, joints: Convention = "zenocap") -> Trajectories:
        """Points of a joint convention in every pose; NaN while the person is lost."""
        return self.track().trajectories(joints)


@dataclass(frozen=True)
class TakeSummary:
    """Body, frame numbers and times of a take, without its poses.

    kind: of the pose messages.  frames, captured_ns: (n,) of the poses, rising.  start_ns: capture time of frame 0.
    cut: description of the damage, None for an intact file.
    """

    anatomy: Anatomy
    bdp: Bdp
    kind: type[Bap]
    frames: Ints
    captured_ns: Ints
    start_ns: int
    cut: str | None


def summary_of(path: Path, *, raw: bool = False, envelopes: Iterable[Envelope] | None = None) -> TakeSummary:
    """Return the summary of the take at `path`, read once, in memory of 16 bytes a pose.  Raises as `read_poses`.

    envelopes: its messages as `envelopes_of` yields them, if they are at hand; `TakeSummary.cut` is not known then.
    """
    take = TakeReader(path)
    read = _read(path, take.envelopes(TOPICS_USED) if envelopes is None else envelopes, raw, lambda bap: bap.frame)
    captured_ns, numbers = (np.array(list(values), dtype=np.int64) for values in (read.kept, read.kept.values()))
    numbers = rising_frames(numbers, (captured_ns - read.start_ns) / 1e9)
    return TakeSummary(read.anatomy, read.bdp, read.kind, numbers, captured_ns, read.start_ns, take.cut)


def rising_frames(numbers: Ints, times_s: Floats) -> Ints:
    """Return strictly rising frame numbers (n,).

    After a restart of a viewer, whose numbers begin again, all are computed from their times and the rate before it.
    """
    again = np.flatnonzero(np.diff(numbers) <= 0)
    if not len(again):
        return numbers
    steps = np.diff(times_s)
    step_s = float(np.median(steps[: again[0]])) if again[0] else float(np.median(steps))
    counted = numbers[0] + np.round((times_s - times_s[0]) / step_s).astype(np.int64)
    return np.maximum.accumulate(counted - np.arange(len(counted))) + np.arange(len(counted))


def read_poses(path: Path, *, raw: bool = False) -> TakePoses:
    """Read the poses of the take at `path`, without those of a separate video of the T-pose.

    raw: those of the forward pass, also of a take that was tracked both ways.

    Raises UserError for a take without poses and for a file that is not a take.
    """
    take = TakeReader(path)
    return poses_of(path, take.envelopes(TOPICS_USED), take, raw=raw)


def poses_of(path: Path, envelopes: Iterable[Envelope], take: TakeReader, *, raw: bool = False) -> TakePoses:
    """See `read_poses`.  path: of the take, for errors."""
    try:
        read = _read(path, envelopes, raw, lambda bap: bap)
    except UserError as error:
        if take.cut is None:
            raise
        raise UserError(f"{take.cut}: {str(error).removeprefix(f'{path}: ')}") from error
    measured = read.measured and (read.kind is not m.UniversalBap or _measures(path, take))
    baps = tuple(read.kept.values())
    notes = take.metadata.get(VIDEO_NOTES, {})
    return TakePoses(path, read.anatomy, read.bdp, baps, read.start_ns, read.cameras, take.cut, measured, notes)


def _measures(path: Path, take: TakeReader) -> bool:
    """Whether the two-view method of a take that has been read measures the body; also of a take that does not state it."""
    with suppress(UserError):
        return SETUP_FILE not in take.attachments or read_setup(path, take.attachments[SETUP_FILE]).person_height is None
    return True


@dataclass(frozen=True)
class _TakeContent(Generic[Kept]):
    """What is kept of each pose, by capture time, rising."""

    kind: type[Bap]
    anatomy: Anatomy
    bdp: Bdp
    kept: dict[int, Kept]
    start_ns: int
    cameras: dict[str, m.CameraInfo]
    measured: bool


def _read(path: Path, envelopes: Iterable[Envelope], raw: bool, keep: Callable[[Bap], Kept]) -> _TakeContent[Kept]:
    bodies: dict[type[Bap], m.Body] = {}
    found: dict[type[Bap], dict[int, Kept]] = {m.UniversalBap: {}, m.TrackerPose: {}, m.BothWaysPose: {}}
    cameras: dict[str, m.CameraInfo] = {}
    measured = True
    for received in envelopes:
        match received.message:
            case m.UniversalBdp(body=body):
                bodies[m.UniversalBap] = body
            case m.TrackerBdp(body=body, measured=measured):
                bodies[m.TrackerPose] = body
            case m.UniversalBap() | m.TrackerPose() as bap:
                found[type(bap)][bap.captured_ns] = keep(bap)
            case m.CameraInfo() as camera:
                cameras[camera.viewer] = camera
    kind = _kind(found, bodies, raw)
    start_ns = min((camera.captured_ns for camera in cameras.values()), default=0)
    # A separate video of the T-pose has capture times before frame 0 and frame numbers of its own.
    kept = {captured_ns: found[kind][captured_ns] for captured_ns in sorted(found[kind]) if captured_ns >= start_ns}
    anatomy, bdp = _body_of(path, kind, bodies.get(m.UniversalBap if kind is m.UniversalBap else m.TrackerPose), len(kept))
    start_ns = start_ns if cameras else next(iter(kept))
    return _TakeContent(kind, anatomy, bdp, kept, start_ns, cameras, measured or kind is m.UniversalBap)


def _kind(found: Mapping[type[Bap], Collection[int]], bodies: Mapping[type[Bap], m.Body], raw: bool) -> type[Bap]:
    """Kind of the poses to use: of both directions, of the tracker, or of the integrator."""
    if found[m.BothWaysPose] and not raw:
        return m.BothWaysPose
    return m.TrackerPose if found[m.TrackerPose] or m.TrackerPose in bodies else m.UniversalBap


def _body_of(path: Path, kind: type[Bap], body: m.Body | None, poses: int) -> tuple[Anatomy, Bdp]:
    """Return anatomy and body.  Raises UserError without body or poses, and for an unknown anatomy."""
    if body is None or not poses:
        name = "universal" if kind is m.UniversalBap else "tracker"
        missing = f"{name} BDP: no T-pose was measured" if body is None else f"{name} BAP"
        raise UserError(f"{path}: no {missing}; nothing can be exported")
    try:
        anatomy = anatomy_of(body)
        return anatomy, bdp_of(anatomy, body)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def limbs_of(baps: Sequence[Bap]) -> dict[str, Floats]:
    """(n,) confidence by limb of n poses, NaN where unknown; empty without any."""
    stated = [bap.limbs if isinstance(bap, m.TrackerPose) else {} for bap in baps]
    names = sorted({limb for limbs in stated for limb in limbs})
    return {name: np.array([limbs.get(name, np.nan) for limbs in stated]) for name in names}


def views_of(bap: Bap) -> Mapping[str, tuple[str, float]]:
    """Role and matching score by viewer; the score is NaN where unknown."""
    if isinstance(bap, m.TrackerPose):
        return {viewer: (USED_ROLE, np.nan) for viewer in bap.views}
    viewers = dict.fromkeys([*bap.views, *bap.scores])
    return {viewer: (bap.views.get(viewer, ""), bap.scores.get(viewer, np.nan)) for viewer in viewers}
