"""What is known of every service of a rig from its messages: a value, for the live table and the plain lines."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import degrees
from types import MappingProxyType

from common import messages as m
from common.bus.protocol import Alive, Envelope

Service = tuple[str, str]  # its name and id

MOST = 256  # services whose health is kept

# What a newcomer recognises; degrees, a straight elbow or knee is 0.
SHOWN_ANGLES = (
    ("turn", "navel.y"),
    ("right elbow", "right_elbow.x"),
    ("left elbow", "left_elbow.x"),
    ("right knee", "right_knee.x"),
    ("left knee", "left_knee.x"),
)


@dataclass(frozen=True)
class Board:
    """health: the last of each service.  alive: who is there.  pose, bodies: the last universal BAP or pose of the tracker;
    bodies seen.  whole: of the poses, those in which every viewer has its part.  posture, postures: the last one; how often
    each was said."""

    health: Mapping[Service, m.Health] = field(default_factory=lambda: MappingProxyType({}))
    alive: frozenset[Service] = frozenset()
    pose: m.UniversalBap | m.TrackerPose | None = None
    poses: int = 0
    whole: int = 0
    bodies: int = 0
    posture: m.Posture | None = None
    postures: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))

    def heard(self, event: Envelope | Alive) -> "Board":
        """The board after one event."""
        match event:
            case Alive(service=service, id=id, alive=alive):
                there = self.alive | {(service, id)} if alive else self.alive - {(service, id)}
                return replace(self, alive=there)
            case Envelope(message=m.Health() as health):
                sender = (health.service, health.id)
                if sender not in self.health and len(self.health) >= MOST:
                    return self
                known = {**self.health, sender: health}
                return replace(self, health=MappingProxyType(known))
            case Envelope(message=m.UniversalBap() as bap):
                return replace(self, pose=bap, poses=self.poses + 1, whole=self.whole + (not bap.stale))
            case Envelope(message=m.TrackerPose() as pose):
                viewers = {id for service, id in self.alive if service == "viewer"}
                return replace(self, pose=pose, poses=self.poses + 1, whole=self.whole + (viewers <= {*pose.views}))
            case Envelope(message=m.UniversalBdp() | m.TrackerBdp()):
                return replace(self, bodies=self.bodies + 1)
            case Envelope(message=m.Posture() as posture):
                words = posture_words(posture)
                said = {**self.postures, words: self.postures.get(words, 0) + 1}
                return replace(self, posture=posture, postures=MappingProxyType(said))
            case _:
                return self

    def angles(self) -> dict[str, int]:
        """The shown joint angles of the last pose, whole degrees."""
        if self.pose is None:
            return {}
        named = self.pose.angles
        return {words: round(degrees(named[name])) for words, name in SHOWN_ANGLES if name in named}


def title(service: Service) -> str:
    name, id = service
    return name if id == "main" else f"{name} {id}"


def view_of(pose: m.UniversalBap | m.TrackerPose | None, viewer: str) -> tuple[str, float | None]:
    """What a viewer has to do with a pose, and its matching score where there is one; "" for nothing."""
    match pose:
        case m.UniversalBap(views=views, scores=scores) if viewer in views:
            return views[viewer], scores.get(viewer)
        case m.TrackerPose(views=used):
            return "used" if viewer in used else "left out", None
        case _:
            return "", None


def posture_words(posture: m.Posture) -> str:
    return posture.label or "none of its postures"


def lost_words(pose: m.UniversalBap | m.TrackerPose) -> str:
    """What is being searched for, and whose part is old; empty when all is well."""
    if isinstance(pose, m.TrackerPose):
        return "searching for the person" if pose.lost else ""
    parts = []
    if pose.lost:
        parts.append("searching for " + ", ".join(name.replace("_", " ") for name in pose.lost))
    if pose.stale:
        parts.append("without viewer " + " and ".join(pose.stale))
    return "; ".join(parts)
