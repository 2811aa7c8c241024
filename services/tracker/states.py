"""State of the tracker: setup, phases of tracking one person, frame sets that wait."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Silhouette, TrackerBdp, TrackerPose
from zenocap.common.rig.tracker import DEFAULT_FILTER, FilterOptions
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.synchronizer import FrameSet, Synchronizer
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, model_of
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter.particles import Cloud, Refinement
from zenocap.services.tracker.initialization.localization import TPose
from zenocap.services.tracker.initialization.online_shape import ShapeEstimate, initial_shape
from zenocap.services.tracker.parameters import INITIAL_SUPPORT, RIVAL_MOST, TOES_START
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.view_check.view_consistency import ViewConsistency

Method = Literal["hybrid", "image-force", "particle-filter"]
METHODS: tuple[Method, ...] = get_args(Method)
RivalKind = Literal["legs", "feet", "back", "first mirror", "second mirror"]
RIVAL_KINDS: tuple[RivalKind, ...] = get_args(RivalKind)
LEG_KINDS: tuple[RivalKind, ...] = ("legs", "feet")
MIRROR_KINDS: tuple[RivalKind, ...] = ("first mirror", "second mirror")
HEADING_KINDS: tuple[RivalKind, ...] = ("back", *MIRROR_KINDS)


@dataclass(frozen=True)
class Turn:
    """The user's decision that at a capture time the person faces along `front` (3,), a unit vector in the world, rather
    than away from it."""

    captured_ns: int
    front: tuple[float, float, float]


@dataclass(frozen=True)
class Options:
    """Options.  points: contour rays per frame set.  iterations: of the refinement.  seed: of all random numbers.

    filter: where the default differs from the paper.  front: viewer whose camera the person faces at the start, or
    heading: direction of the front then, radians about +Y from +Z; None: as the feet show.  turns: later decisions.
    """

    method: Method = "hybrid"
    particles: int = 40
    points: int = 400
    iterations: int = 4
    seed: int = 0
    refinement: Refinement = "gauss-newton"
    filter: FilterOptions = DEFAULT_FILTER
    front: str | None = None
    heading: float | None = None
    turns: tuple[Turn, ...] = ()


@dataclass(frozen=True)
class TrackerSetup:
    """Setup of the tracker.

    cameras: by viewer, at the working size, in the rig's order.  frame_ns: frame period.  person_height: metres.
    follow_delays: whether the integrator corrects the delays of the cameras.  delays_ns: by viewer, `delay_ms` of the rig
    file, which the viewers have corrected; 0 for others.
    """

    anatomy: Anatomy
    cameras: Mapping[str, Camera]
    frame_ns: int
    prior: Prior | None
    options: Options
    person_height: float | None = None
    follow_delays: bool = False
    delays_ns: Mapping[str, int] = field(default_factory=dict)

    def hold(self, applied_ns: Mapping[str, int]) -> int:
        """Arrival spread within a frame set (frame periods), from delays that viewers and tracker correct."""
        delays = [self.delays_ns.get(viewer, 0) + applied_ns.get(viewer, 0) for viewer in self.cameras]
        return -((min(delays) - max(delays)) // self.frame_ns)


def with_detail(setup: TrackerSetup, detail: float) -> TrackerSetup:
    """The setup with this share of its points and particles."""
    if detail == 1:
        return setup
    points, particles = (max(1, round(detail * number)) for number in (setup.options.points, setup.options.particles))
    return replace(setup, options=replace(setup.options, points=points, particles=particles))


@dataclass(frozen=True)
class AwaitingPerson:
    """Waiting for a person in T-pose, or measuring the body.

    seen, t_poses: evidence and T-pose of the frame sets so far.  rest: frame sets to skip.
    advice: instruction for the person, shown in health.  heights: capture time and height in metres of the person in every
    frame set since one came into view.  places: the same of one who may be on the floor, height, x and z of the middle.
    appeared: no other was in view since the scene was empty.
    t_pose_only: a user requested the measurement, so nothing else starts the track.
    """

    advice: str = "waiting for a person"
    seen: tuple[Evidence, ...] = ()
    t_poses: tuple[TPose, ...] = ()
    rest: int = 0
    heights: tuple[tuple[int, float], ...] = ()
    places: tuple[tuple[int, Floats], ...] = ()
    appeared: bool = False
    t_pose_only: bool = False


@dataclass(frozen=True)
class TrackedPerson:
    """A person with known sizes.  body: sizes.  model: the same for compiled functions.  stature: metres.

    expected_support: running mean of the fraction of a scene that is on the body; lower with fewer views, which give a
    less sharp hull.  heading_known: False while the feet do not show which side is the front, or a rival may be right.
    detail: at most 1, (FIT_RESIDUAL_SCALE_M / size of a pixel at the person)^2; weight of the rays' evidence on the sizes.
    measured: whether the sizes are those of a T-pose; else they began as average ones.
    measuring: of a body that this process has not measured: an average one, or one from before a restart; else None.
    """

    body: Bdp
    model: BodyModel
    stature: float
    shape: ShapeEstimate
    expected_support: float
    heading_known: bool = True
    detail: float = 1.0
    measured: bool = True
    measuring: AwaitingPerson | None = None

    @staticmethod
    def of(anatomy: Anatomy, body: Bdp, stature: float) -> "TrackedPerson":
        """A person of these sizes, not observed yet."""
        return TrackedPerson(body, model_of(anatomy, body), stature, initial_shape(body), INITIAL_SUPPORT)


@dataclass(frozen=True)
class Rival:
    """Another explanation of the silhouettes beside the estimate.

    kind: the other leg ahead; the feet in each other's places and the trunk turned; heading opposite, with the limbs
    exchanged; heading mirrored about the first or second of two viewing directions, or of the start another one.
    nats: log odds against the estimate, at most RIVAL_MOST either way; they stay while no such pose fits: None.
    """

    kind: RivalKind
    nats: float = 0.0
    pose: RootedPose | None = None


def refuted(*kinds: RivalKind) -> tuple[Rival, ...]:
    """Rivals of a track whose sides are known."""
    return tuple(Rival(kind, -RIVAL_MOST) for kind in kinds)


@dataclass(frozen=True)
class Tracking:
    """Tracking a person.  cloud: particles.  estimate: last pose.  velocity: (6 + d,) change of the pose per second.

    prior_fraction: fraction of proposals from the prior.  prior_distance: running mean of the estimate's distance from the
    prior, radians.  misfits_in_row: consecutive frames in which the body misfits the scene.
    limb_support: (4,) share of the rays that is usually on each limb; None before the first frame.
    toes: running mean of the feet's reach forward of the shanks (statures).
    limb_features: (4, features) running means, see `zenocap.services.tracker.filter.confidence`; None at the start.
    ambiguity: (4,) of the limbs, metres, see there.
    corrected_ns: capture time of the last correction by a jump, see `filter_step.start_tracking`.
    decided_ns: capture time at which the user has decided on front and back; None: the feet have.
    rivals: at most one of each kind, see `zenocap.services.tracker.filter.rivals`.
    """

    person: TrackedPerson
    cloud: Cloud
    estimate: RootedPose
    velocity: Floats
    captured_ns: int
    prior_fraction: float
    prior_distance: float = 0.0
    misfits_in_row: int = 0
    limb_support: Floats | None = None
    toes: float = TOES_START
    limb_features: Floats | None = None
    corrected_ns: int = 0
    ambiguity: Floats = field(default_factory=lambda: np.zeros(4))
    decided_ns: int | None = None
    rivals: tuple[Rival, ...] = ()


@dataclass(frozen=True)
class Lost:
    """Searching for a person with a measured body.

    last: the last pose, at seen_ns.  rest: frame sets to skip before the next search, which is on_floor or not.
    """

    person: TrackedPerson
    last: RootedPose | None
    rest: int = 0
    seen_ns: int = 0
    on_floor: bool = False


@dataclass(frozen=True)
class TrackState:
    """State of tracking one person.  count: frame sets so far, from which the next one's random seed is derived."""

    phase: AwaitingPerson | Tracking | Lost
    consistency: ViewConsistency
    count: int = 0


@dataclass(frozen=True)
class Outcome:
    """Result of one frame set.  body: None unless it changed.  pose: None without one.  views: those used.
    measured: whether the body was measured in the T-pose.

    spread: (angles + 3,) standard deviations over the particles: joint angles, radians, then position, metres.
    points: (n, 3) scene points, metres.  limb_features: see `Tracking`.  toes: as of `Tracking`, None without a pose.
    against: greatest log odds of a rival of the heading, see `Rival`.
    """

    body: Bdp | None
    pose: Pose | None
    spread: Floats
    likelihood: float
    effective: float
    lost: bool
    views: tuple[str, ...]
    findings: tuple[str, ...] = ()
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    limb_features: Floats | None = None
    toes: float | None = None
    against: float = -np.inf
    measured: bool = True


@dataclass(frozen=True)
class TrackerState:
    """State of the tracker.

    track: of the person.  pairs: synchronizer of the silhouettes.  ready: frame sets that wait for a Tick.
    pose: last published.  offsets: clock offset of each viewer to the integrator.  warnings, calibrations: by viewer,
    health texts about its clock and its camera.  findings: health texts about views.  used: views of the last frame set.
    points_ns: capture time of the last published scene points.  counts: of lost input, by reason.
    previous_body: of the tracker before a restart, waiting for its pose.  remeasure: a new measurement was requested, so a
    previous body is ignored.  detail: share of the points and particles in use, less than 1 under overload.
    delays_ns: corrected age of the viewers' images beyond their capture times.
    body: last published.  contradicted: another one was received, which is shown now: the own one is sent again.
    behind: frame sets to be tracked without a drop before a second one waits again.  reduced: the rig leaves out frames.
    """

    track: TrackState
    pairs: Synchronizer[Silhouette]
    ready: tuple[FrameSet[Silhouette], ...] = ()
    pose: TrackerPose | None = None
    offsets: Mapping[str, Offset] = field(default_factory=dict)
    warnings: Mapping[str, str] = field(default_factory=dict)
    calibrations: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    used: tuple[str, ...] = ()
    points_ns: int = 0
    counts: Mapping[str, int] = field(default_factory=dict)
    previous_body: TrackerBdp | None = None
    remeasure: bool = False
    detail: float = 1.0
    delays_ns: Mapping[str, int] = field(default_factory=dict)
    body: TrackerBdp | None = None
    contradicted: bool = False
    behind: int = 0
    reduced: bool = False
