"""The integrator's setup and what it remembers."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.camera.level import level_view
from common.camera.pinhole import Camera
from common.messages import PartialBap, PartialBdp, Sighting, UniversalBdp
from common.pairing import Pairs
from common.runtime.clock import Offset
from services.integrator.arbitrator import View

INSTANTS_OF_BODY = 5  # pairs of partial BDPs that the universal one is the median of


@dataclass(frozen=True)
class Setup:
    """cameras: the level view of each viewer's camera, by viewer id, in the rig's order.  frame_ns: frame period.

    height: of the person in metres, to go by instead of the initial posture; None to measure.
    """

    anatomy: Anatomy
    cameras: Mapping[str, Camera]
    frame_ns: int
    height: float | None = None


def integrator_setup(anatomy: Anatomy, cameras: Mapping[str, Camera], frame_ns: int, height: float | None = None) -> Setup:
    """cameras: each viewer's, at its working size.  height: see `Setup`.

    Raises ValueError for other than two viewers, or a camera that looks straight up or down.
    """
    if len(cameras) != 2:
        raise ValueError(f"two-view needs two viewers; the rig has {len(cameras)}: {', '.join(cameras)}")
    return Setup(anatomy, {viewer: level_view(camera).camera for viewer, camera in cameras.items()}, frame_ns, height)


@dataclass(frozen=True)
class Placed:
    """Where one instant's assignment put the body.  position: (3,) metres.  yaw, lean, roll: of the torso, radians.

    stale: viewers whose part is an old one.
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
class Person:
    """The person being tracked.  pose: of the last universal BAP.  placed: the last assignments, oldest first.

    height: of the navel in the initial posture, metres.  stance: theta_Z of the hips from straight down there, radians.
    exchange: evidence that the legs were taken for each other.  backwards: metres walked backwards of late.
    toes: by viewer, how far the feet reach past the shins of late, metres to the right of the image.
    """

    bdp: Bdp
    pose: Pose
    placed: tuple[Placed, ...]
    height: float
    stance: float = 0.0
    exchange: float = 0.0
    backwards: float = 0.0
    toes: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class State:
    """sightings, baps, bdps: what waits for its pair.  views: arbitrated, by viewer.  bodies: (front, side) BDPs so far.

    last: each viewer's last sighting of a person.  first: the newest assignment made before the body is known.
    offsets: each viewer's clock against this one.  asked_ns: since when the arbitrator asks for other views, or 0.
    warnings: by viewer, what the person should know of its clock.
    said: the body as it was last said, by this integrator or, if a reader told, by the one before it.  anew: the body is
    to be measured anew.  answered: by viewer, when it last said where the limbs are or was reminded of the body.
    """

    sightings: Pairs[Sighting]
    baps: Pairs[PartialBap]
    bdps: Pairs[PartialBdp]
    views: Mapping[str, View]
    bodies: tuple[tuple[PartialBdp, PartialBdp], ...] = ()
    last: Mapping[str, Sighting] = field(default_factory=dict)
    first: Placed | None = None
    person: Person | None = None
    offsets: Mapping[str, Offset] = field(default_factory=dict)
    warnings: Mapping[str, str] = field(default_factory=dict)
    problem: str = ""
    asked_ns: int = 0
    said: UniversalBdp | None = None
    anew: bool = False
    answered: Mapping[str, int] = field(default_factory=dict)
