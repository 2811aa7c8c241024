"""The tracker's setup, and what it knows of the person from one instant to the next."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.camera.pinhole import Camera
from services.tracker.agreement import Agreement
from services.tracker.closest import Singles
from services.tracker.initial import Stretched
from services.tracker.knowledge import Knowledge
from services.tracker.model import Model
from services.tracker.particles import Cloud
from services.tracker.posed import Posed
from services.tracker.prior.model import Prior
from services.tracker.room import Room

Mask = NDArray[np.uint8]
Method = Literal["hybrid", "image-force", "particle-filter"]
Refinement = Literal["gauss-newton", "force", "force-printed"]


@dataclass(frozen=True)
class Options:
    """points: of the visual hull.  iterations: of the refinement.  seed: of everything that is drawn."""

    method: Method = "hybrid"
    particles: int = 40
    points: int = 400
    iterations: int = 4
    seed: int = 0
    refinement: Refinement = "gauss-newton"


@dataclass(frozen=True)
class Setup:
    """cameras: by viewer, at the working size, in the rig's order.  frame_ns: frame period.  person_height: metres."""

    anatomy: Anatomy
    cameras: Mapping[str, Camera]
    frame_ns: int
    prior: Prior | None
    options: Options
    person_height: float | None = None


@dataclass(frozen=True)
class Waiting:
    """Nobody is known yet.  scenes: rays of the initial posture so far, with the room that the silhouettes leave and what
    they show.  rest: instants to wait."""

    advice: str = "waiting for a person"
    scenes: tuple[Singles, ...] = ()
    rooms: tuple[Room, ...] = ()
    seen: tuple[Stretched, ...] = ()
    rest: int = 0


@dataclass(frozen=True)
class Person:
    """body: as measured.  model: the same for compiled code.  stature: metres.

    typical: the share of a scene that usually lies on the body; it falls with fewer views, whose hull is less sharp.
    faces: whether it was clear which way the person faced.
    """

    body: Bdp
    model: Model
    stature: float
    knowledge: Knowledge
    typical: float
    faces: bool = True


@dataclass(frozen=True)
class Tracking:
    """cloud: the particles.  estimate: the last pose, with the change (6 + d,) a second before it.

    prior_share: of the proposals.  strange: usual distance of the estimate from the prior, radians.
    bad: instants in a row in which the body was not where the scene is.
    """

    person: Person
    cloud: Cloud
    estimate: Posed
    velocity: Floats
    captured_ns: int
    prior_share: float
    strange: float = 0.0
    bad: int = 0


@dataclass(frozen=True)
class Lost:
    """The body is known, but not where it is.

    last: the pose before, at seen_ns.  rest: instants before it is searched for again.
    """

    person: Person
    last: Posed | None
    rest: int = 0
    seen_ns: int = 0


@dataclass(frozen=True)
class TrackState:
    """phase: what is known of the person.  agreement: of the views with one another.  count: instants so far."""

    phase: Waiting | Tracking | Lost
    agreement: Agreement
    count: int = 0


@dataclass(frozen=True)
class Outcome:
    """body: when it was newly measured.  pose: None while there is none.  views: those that were used.

    spread: (angles + 3,) standard deviations over the particles, radians, then the position's, metres.
    points: (n, 3) of the visual hull, metres.
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
