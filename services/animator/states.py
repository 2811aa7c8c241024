"""The animator's setup, and what it remembers of everything that is said on the rig."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from common import messages as m
from common.body.anatomy import Anatomy
from common.body.definition import Bdp
from common.camera.pinhole import Camera
from services.animator.snapshot import Actor, Source

Service = tuple[str, str]  # its name and id

STALE_NS = 1_000_000_000  # a viewer whose frames stopped so long ago
SILENT_NS = 2_500_000_000  # any service, which says its health every second
MOST = 128  # services, and viewers of which something is kept


@dataclass(frozen=True)
class Setup:
    """expected: the services of the rig, in the order in which they are shown; others follow as they come."""

    expected: tuple[Service, ...] = ()


@dataclass(frozen=True)
class Heard:
    """What is known of one service.  heard_ns, frame_ns: its last message, and its last one of a frame; 0 for none yet.

    alive: as liveliness says; None before it does.  went_ns: when it went.  All by this machine's clock.
    """

    heard_ns: int = 0
    frame_ns: int = 0
    alive: bool | None = None
    went_ns: int = 0
    health: m.Health | None = None


@dataclass(frozen=True)
class Body:
    """said: the message's body, by which a change is noticed."""

    anatomy: Anatomy
    bdp: Bdp
    said: m.Body


@dataclass(frozen=True)
class State:
    """The last of everything.  bodies, actors: by who found them.

    unusable: messages that are valid but fit no body known here, no camera that there can be, or no whole points.
    """

    now_ns: int = 0
    bodies: Mapping[Source, Body] = field(default_factory=dict)
    actors: Mapping[Source, Actor] = field(default_factory=dict)
    services: Mapping[Service, Heard] = field(default_factory=dict)
    silhouettes: Mapping[str, m.Silhouette] = field(default_factory=dict)
    sightings: Mapping[str, m.Sighting] = field(default_factory=dict)
    previews: Mapping[str, m.Preview] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    assignment: m.Assignment | None = None
    posture: m.Posture | None = None
    points: m.ScenePoints | None = None
    unusable: int = 0
