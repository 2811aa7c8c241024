"""The poses of a take, whoever found them, as arrays of the human model: the one place that knows their messages."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from common import messages as m
from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.bus.protocol import Envelope
from common.codec import BadMessage
from common.conversion import anatomy_of, angles_of, bdp_of
from common.formats.track import PoseTrack, rate_of
from common.formats.trc import FormatError, Trajectories
from common.take.reading import Take, envelope
from common.topics import CAMERA, TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP, topic_at

Bap: TypeAlias = m.UniversalBap | m.TrackerPose
NO_PART = ("", np.nan)
WANTED = (CAMERA, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE)
USED = "used"  # what a view was for the tracker


@dataclass(frozen=True)
class Poses:
    """What a take says of one person.

    baps: in the order of their capture times, one each.  bdp: the last one.  start_ns: capture time of frame 0.
    cameras: by viewer.  cut: what is missing of the file, None when it is whole.
    """

    path: Path
    anatomy: Anatomy
    bdp: Bdp
    baps: tuple[Bap, ...]
    start_ns: int
    cameras: dict[str, m.CameraInfo]
    cut: str | None

    def pose(self, bap: Bap) -> Pose:
        return pose_of(self.anatomy, bap)

    @property
    def frames(self) -> NDArray[np.int64]:
        """(n,) frame numbers of `baps`, rising.

        Where they begin again, because a viewer was restarted, all are counted by their time at the first part's rate.
        """
        numbers = np.array([bap.frame for bap in self.baps], dtype=np.int64)
        again = np.flatnonzero(np.diff(numbers) <= 0)
        if not len(again):
            return numbers
        steps = np.diff(self.times_s)
        step_s = float(np.median(steps[: again[0]])) if again[0] else float(np.median(steps))
        counted = numbers[0] + np.round((self.times_s - self.times_s[0]) / step_s).astype(np.int64)
        return np.maximum.accumulate(counted - np.arange(len(counted))) + np.arange(len(counted))

    @property
    def times_s(self) -> Floats:
        """(n,) seconds since frame 0."""
        return np.array([(bap.captured_ns - self.start_ns) / 1e9 for bap in self.baps])

    def rate(self) -> float:
        """Frames per second."""
        return rate_of(self.frames, self.times_s)

    def track(self) -> PoseTrack:
        """The poses as arrays, for the formats."""
        parts = [parts_of(bap) for bap in self.baps]
        viewers = sorted({viewer for part in parts for viewer in part} | set(self.cameras))
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
            scores={viewer: np.array([part.get(viewer, NO_PART)[1] for part in parts]) for viewer in viewers},
            views={viewer: tuple(part.get(viewer, NO_PART)[0] for part in parts) for viewer in viewers},
            lost=tuple(" ".join(searched_for(bap)) for bap in self.baps),
            rate=self.rate(),
        )

    def trajectories(self) -> Trajectories:
        """Joint centres of every pose; blank while the person is lost."""
        return self.track().trajectories()


def read_poses(path: Path) -> Poses:
    """The poses of the take at `path`, those of a separate video of the initial posture left out.

    Raises FormatError for a take without any, and TakeError for a file that is no take.
    """
    take = Take(path)
    return poses_of(path, _envelopes(take), take)


def poses_of(path: Path, envelopes: Iterable[Envelope], take: Take) -> Poses:
    """See `read_poses`; path: of the take, for errors."""
    bodies: dict[type[Bap], m.Body] = {}
    baps: dict[type[Bap], dict[int, Bap]] = {m.UniversalBap: {}, m.TrackerPose: {}}
    cameras: dict[str, m.CameraInfo] = {}
    for received in envelopes:
        match received.message:
            case m.UniversalBdp(body=found):
                bodies[m.UniversalBap] = found
            case m.TrackerBdp(body=found):
                bodies[m.TrackerPose] = found
            case m.UniversalBap() | m.TrackerPose() as bap:
                baps[type(bap)][bap.captured_ns] = bap
            case m.CameraInfo() as camera:
                cameras[camera.viewer] = camera
    kind: type[Bap] = m.TrackerPose if baps[m.TrackerPose] or m.TrackerPose in bodies else m.UniversalBap
    body = bodies.get(kind)
    start_ns = min((camera.captured_ns for camera in cameras.values()), default=0)
    # A video of the initial posture lies before frame 0 and counts for itself.
    moving = [bap for captured_ns, bap in sorted(baps[kind].items()) if captured_ns >= start_ns]
    if body is None or not moving:
        name = "tracker" if kind is m.TrackerPose else "universal"
        missing = f"{name} BDP: the initial posture was not seen" if body is None else f"{name} BAP"
        raise FormatError(f"{path}: no {missing}; nothing can be exported")
    if not cameras:
        start_ns = moving[0].captured_ns
    try:
        anatomy = anatomy_of(body)
        bdp = bdp_of(anatomy, body)
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from error
    return Poses(path, anatomy, bdp, tuple(moving), start_ns, cameras, take.cut)


def is_lost(bap: Bap) -> bool:
    """Whether the person is, so that the pose means nothing."""
    return bap.lost if isinstance(bap, m.TrackerPose) else "person" in bap.lost


def searched_for(bap: Bap) -> Sequence[str]:
    """What is being searched for: limbs, or "person"."""
    return (["person"] if bap.lost else []) if isinstance(bap, m.TrackerPose) else bap.lost


def parts_of(bap: Bap) -> Mapping[str, tuple[str, float]]:
    """By viewer, what its view was, and its matching score, NaN where there is none."""
    if isinstance(bap, m.TrackerPose):
        return {viewer: (USED, np.nan) for viewer in bap.views}
    viewers = dict.fromkeys([*bap.views, *bap.scores])
    return {viewer: (bap.views.get(viewer, ""), bap.scores.get(viewer, np.nan)) for viewer in viewers}


def pose_of(anatomy: Anatomy, bap: Bap) -> Pose:
    """A BAP as arrays; an angle that it does not have is that of standing upright.

    Raises ValueError for an angle that the anatomy does not have.
    """
    return Pose(np.array(bap.position, dtype=np.float64), angles_of(anatomy, bap.angles, anatomy.neutral))


def _envelopes(take: Take) -> Iterable[Envelope]:
    for recorded in take.messages():
        if topic_at(recorded.topic) not in WANTED:
            continue
        try:
            received = envelope(recorded)
        except BadMessage:
            continue  # a version of ours that this one does not read
        if received is not None:
            yield received
