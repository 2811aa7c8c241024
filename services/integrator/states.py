"""Setup and state of the integrator."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.camera.level_view import level_view
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import PartialBap, PartialBdp, Sighting, UniversalBdp
from zenocap.common.rig.two_view import IMPROVED, Additions
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.synchronizer import Synchronizer
from zenocap.services.integrator.parameters import LEAST_ORIGIN_M
from zenocap.services.integrator.rate_reports import RateSetup, RateState
from zenocap.services.integrator.two_view.arbitrator import View


@dataclass(frozen=True)
class IntegratorSetup:
    """Setup of the integrator.

    cameras: level view of each camera, by viewer id, in the order of the rig.  frame_ns: frame period.
    height: of the person in metres, which replaces measuring in the T-pose; None to measure.
    additions: to the paper, see `zenocap.common.rig.two_view`.
    """

    anatomy: Anatomy
    cameras: Mapping[str, Camera]
    frame_ns: int
    height: float | None = None
    additions: Additions = IMPROVED

    @property
    def rate(self) -> RateSetup:
        return RateSetup(tuple(self.cameras), 1e9 / self.frame_ns)


def integrator_setup(
    anatomy: Anatomy,
    cameras: Mapping[str, Camera],
    frame_ns: int,
    height: float | None = None,
    additions: Additions = IMPROVED,
) -> IntegratorSetup:
    """Setup of an integrator.  cameras: of each viewer, at its working size.  height, additions: see `IntegratorSetup`.

    Raises ValueError for other than two viewers, for a camera that looks straight up or down, and for one behind which the
    origin lies when the scaling factors, which relate to the origin, are in use.
    """
    if len(cameras) != 2:
        raise ValueError(f"two-view needs two viewers; the rig has {len(cameras)}: {', '.join(cameras)}")
    levels = {viewer: level_view(camera).camera for viewer, camera in cameras.items()}
    for viewer, camera in levels.items():
        if "perspective" not in additions and camera.translation[2] < LEAST_ORIGIN_M:
            raise ValueError(
                f"viewer {viewer}: the origin of the calibration is {camera.translation[2]:.2f} m before the camera: "
                f"allowed: {LEAST_ORIGIN_M} m or more, the paper's scaling factors relate to it"
            )
    return IntegratorSetup(anatomy, levels, frame_ns, height, additions)


@dataclass(frozen=True)
class AssignedRootPose:
    """Root pose assigned in one frame set.  position: (3,) metres.  yaw, lean, roll: of the torso, radians.

    stale: viewers without a sighting in it.
    """

    captured_ns: int
    position: Floats
    yaw: float
    lean: float
    roll: float
    squatting: bool
    views: Mapping[str, View]
    stale: tuple[str, ...]


@dataclass(frozen=True)
class IntegratedPerson:
    """The tracked person.  pose: of the last universal BAP.  placed: the last assignments, oldest first.

    height: of the navel in the T-pose, metres.
    exchange: evidence that the legs are exchanged.  backwards: recent distance walked backwards, metres.
    toes: by viewer, recent distance of the feet from the shins, metres to the right of the image.
    """

    bdp: Bdp
    pose: Pose
    placed: tuple[AssignedRootPose, ...]
    height: float
    exchange: float = 0.0
    backwards: float = 0.0
    toes: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class IntegratorState:
    """State of the integrator.

    sightings, baps, bdps: waiting for their pair.  views: arbitrated, by viewer.  bodies: (front, side) BDPs so far.
    last: last sighting of a person by viewer.  first: newest assignment before the body is known.
    offsets: clock of each viewer relative to this one.  warnings: clock warnings by viewer, health text.
    problem: health text.  asked_ns: time since which the arbitrator requests other views, or 0.
    published_body: last universal BDP, of this integrator or recovered from the one before a restart.
    discard_recovered: a new measurement was requested; recovered bodies and poses are ignored.
    answered: by viewer, time of its last partial BAP or of the last reminder.  rate: of the frames under overload.
    contradicted: another universal BDP than the published one was received, which the viewers have now.
    """

    sightings: Synchronizer[Sighting]
    baps: Synchronizer[PartialBap]
    bdps: Synchronizer[PartialBdp]
    views: Mapping[str, View]
    bodies: tuple[tuple[PartialBdp, PartialBdp], ...] = ()
    last: Mapping[str, Sighting] = field(default_factory=dict)
    first: AssignedRootPose | None = None
    person: IntegratedPerson | None = None
    offsets: Mapping[str, Offset] = field(default_factory=dict)
    warnings: Mapping[str, str] = field(default_factory=dict)
    problem: str = ""
    asked_ns: int = 0
    published_body: UniversalBdp | None = None
    discard_recovered: bool = False
    answered: Mapping[str, int] = field(default_factory=dict)
    rate: RateState = field(default_factory=RateState)
    contradicted: bool = False
