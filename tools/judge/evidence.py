"""Evidence for the verdict from a take's messages: poses, silhouettes 4 times a second."""

from collections import deque
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.segments import LIMBS
from zenocap.common.camera_advice import TakeAdvice
from zenocap.common.conversion import anatomy_of, bdp_of, camera_of, is_lost
from zenocap.tools.judge.parameters import LAG_NS, LAG_STEP_NS, PAIRED_NS, SAMPLE_NS
from zenocap.tools.judge.repeated import Repeated

RECENT = 16  # silhouettes of a viewer among which that of a pose is searched


@dataclass(frozen=True, slots=True)
class PoseRow:
    """One pose.  angles: (angles,) radians, in the order of `TakeEvidence.names`.

    limbs: (4,) probability of LIMBS to be right, NaN where unknown.  heading: the same, NaN where unknown.  used: number
    of views.
    """

    frame: int
    position: Floats
    angles: Floats
    lost: bool
    limbs: Floats
    heading: float
    used: int


@dataclass(slots=True)
class Sample:
    """Silhouettes of one frame set.  pose_ns: capture time of the pose that used them; None without one.

    frozen: whether those of frozen views are left out, see `TakeEvidence.live`.
    """

    pose_ns: int | None = None
    silhouettes: dict[str, m.Silhouette] = field(default_factory=dict)
    frozen: bool = False


@dataclass
class TakeEvidence:
    """cameras: by viewer.  tracker_body, universal_body: the last ones.  measured: whether the tracker's is.

    forward, both: poses by capture time, of the tracker or the integrator, and of both passes.  samples: by number of
    SAMPLE_NS since the epoch.  names: of the joint angles.  beginnings: by viewer, silhouettes of the first LAG_NS in
    which it shows something.  advice: of the cameras.  repeated: silhouettes of frozen views.
    """

    cameras: dict[str, m.CameraInfo] = field(default_factory=dict)
    tracker_body: m.Body | None = None
    universal_body: m.Body | None = None
    measured: bool = True
    forward: dict[int, PoseRow] = field(default_factory=dict)
    both: dict[int, PoseRow] = field(default_factory=dict)
    samples: dict[int, Sample] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    beginnings: dict[str, list[m.Silhouette]] = field(default_factory=dict)
    advice: TakeAdvice = field(default_factory=TakeAdvice)
    repeated: Repeated = field(default_factory=Repeated)
    _recent: dict[str, deque[m.Silhouette]] = field(default_factory=dict)

    def add(self, message: m.Message) -> None:
        """Add the next message of a take; those that do not matter are ignored."""
        match message:
            case m.Silhouette():
                self._add_silhouette(message)
            case m.CameraAdvice():
                self.advice.add(message)
            case m.BothWaysPose():
                self.both[message.captured_ns] = self._row(message, self.forward.get(message.captured_ns))
            case m.TrackerPose() | m.UniversalBap():
                if isinstance(message, m.TrackerPose) or self.tracker_body is None:
                    self.forward[message.captured_ns] = self._row(message)
                    self._add_sample(message.captured_ns)
            case m.TrackerBdp():
                self.tracker_body, self.measured = message.body, message.measured
            case m.UniversalBdp():
                self.universal_body = message.body
            case m.CameraInfo():
                with suppress(ValueError):  # no camera: any program may publish one on an open network
                    camera_of(message)
                    self.cameras[message.viewer] = message

    @property
    def poses(self) -> Mapping[int, PoseRow]:
        """The poses that are used by default: of both passes, where there are any."""
        return self.both or self.forward

    @property
    def body(self) -> m.Body | None:
        """The last body, of the tracker if there is one."""
        return self.tracker_body or self.universal_body

    def live(self) -> "TakeEvidence":
        """The evidence without the silhouettes of frozen views."""
        samples = {}
        for number, sample in self.samples.items():
            kept = {viewer: one for viewer, one in sample.silhouettes.items() if not self.repeated.includes(one)}
            samples[number] = Sample(sample.pose_ns, kept, len(kept) < len(sample.silhouettes))
        beginnings = {
            viewer: [one for one in every if not self.repeated.includes(one)] for viewer, every in self.beginnings.items()
        }
        return replace(self, samples=samples, beginnings=beginnings)

    def _add_silhouette(self, silhouette: m.Silhouette) -> None:
        self.repeated.add(silhouette)
        self._recent.setdefault(silhouette.viewer, deque(maxlen=RECENT)).append(silhouette)
        if silhouette.data:
            kept = self.beginnings.setdefault(silhouette.viewer, [])
            since_ns = silhouette.captured_ns - kept[0].captured_ns if kept else 0
            if since_ns < LAG_NS and (not kept or silhouette.captured_ns - kept[-1].captured_ns >= LAG_STEP_NS):
                kept.append(silhouette)
        sample = self.samples.setdefault(silhouette.captured_ns // SAMPLE_NS, Sample())
        if sample.pose_ns is None:
            sample.silhouettes.setdefault(silhouette.viewer, silhouette)

    def _add_sample(self, captured_ns: int) -> None:
        """Take the silhouettes of the first pose of each SAMPLE_NS."""
        sample = self.samples.setdefault(captured_ns // SAMPLE_NS, Sample())
        if sample.pose_ns is not None:
            return
        sample.pose_ns = captured_ns
        sample.silhouettes = {}
        for viewer, recent in self._recent.items():
            nearest = min(recent, key=lambda one: abs(one.captured_ns - captured_ns))
            if abs(nearest.captured_ns - captured_ns) <= PAIRED_NS:
                sample.silhouettes[viewer] = nearest

    def _row(self, bap: m.TrackerPose | m.UniversalBap, ahead: PoseRow | None = None) -> PoseRow:
        """ahead: of the forward pass, for what takes of earlier versions do not state of a pose of the backward pass."""
        self.names = self.names or tuple(bap.angles)
        limbs, heading = (np.full(len(LIMBS), np.nan), np.nan) if ahead is None else (ahead.limbs, ahead.heading)
        used = len(bap.views)
        if isinstance(bap, m.TrackerPose):
            limbs = np.array([bap.limbs.get(limb, usual) for limb, usual in zip(LIMBS, limbs, strict=True)])
            heading = heading if bap.heading is None else bap.heading
        angles = np.array([bap.angles.get(name, 0.0) for name in self.names])
        return PoseRow(bap.frame, np.array(bap.position), angles, is_lost(bap), limbs, heading, used)


def evidence_of(messages: Iterable[m.Message]) -> TakeEvidence:
    """Evidence of the messages of a take."""
    found = TakeEvidence()
    for message in messages:
        found.add(message)
    return found


@dataclass(frozen=True)
class TakeBody:
    """Body of a take.  order: of the evidence's angles in those of the anatomy."""

    anatomy: Anatomy
    bdp: Bdp
    order: Ints

    def pose(self, row: PoseRow) -> Pose:
        angles = self.anatomy.neutral.copy()
        angles[self.order] = row.angles
        return Pose(row.position, angles)


def body_of(evidence: TakeEvidence) -> TakeBody | None:
    """The last body; None without one, or of a version whose angles are unknown."""
    if evidence.body is None:
        return None
    try:
        anatomy = anatomy_of(evidence.body)
        order = np.array([anatomy.index[name] for name in evidence.names], dtype=np.int64)
        return TakeBody(anatomy, bdp_of(anatomy, evidence.body), order)
    except (ValueError, KeyError):
        return None
