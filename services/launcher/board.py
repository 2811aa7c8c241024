"""What is known of every service of a rig from its messages: a value, for the live table and the plain lines."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import degrees
from types import MappingProxyType

from common import messages as m
from common.bus.protocol import Alive, Envelope

Service = tuple[str, str]  # its name and id

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
    """health: the last of each service.  alive: who is there.  bap, bodies: the last universal BAP; universal BDPs seen."""

    health: Mapping[Service, m.Health] = field(default_factory=lambda: MappingProxyType({}))
    alive: frozenset[Service] = frozenset()
    bap: m.UniversalBap | None = None
    poses: int = 0
    both: int = 0
    bodies: int = 0

    def heard(self, event: Envelope | Alive) -> "Board":
        """The board after one event."""
        match event:
            case Alive(service=service, id=id, alive=alive):
                there = self.alive | {(service, id)} if alive else self.alive - {(service, id)}
                return replace(self, alive=there)
            case Envelope(message=m.Health() as health):
                known = {**self.health, (health.service, health.id): health}
                return replace(self, health=MappingProxyType(known))
            case Envelope(message=m.UniversalBap() as bap):
                return replace(self, bap=bap, poses=self.poses + 1, both=self.both + (not bap.stale))
            case Envelope(message=m.UniversalBdp()):
                return replace(self, bodies=self.bodies + 1)
            case _:
                return self

    def angles(self) -> dict[str, int]:
        """The shown joint angles of the last universal BAP, whole degrees."""
        if self.bap is None:
            return {}
        named = self.bap.angles
        return {words: round(degrees(named[name])) for words, name in SHOWN_ANGLES if name in named}


def title(service: Service) -> str:
    name, id = service
    return name if id == "main" else f"{name} {id}"


def lost_words(bap: m.UniversalBap) -> str:
    """What is being searched for, and whose part is old; empty when all is well."""
    parts = []
    if bap.lost:
        parts.append("searching for " + ", ".join(name.replace("_", " ") for name in bap.lost))
    if bap.stale:
        parts.append("without viewer " + " and ".join(bap.stale))
    return "; ".join(parts)
