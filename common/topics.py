"""The table of keys: one row per topic.  No key string appears anywhere else."""

from dataclasses import dataclass
from enum import Enum

from common import messages as m


class Queueing(Enum):
    """What a slow reader gets.  No topic may ever block its publisher."""

    KEPT = "the last one, also when it joins late"
    LATEST = "only the newest"
    ALL = "every one, in order, while its queue lasts"


@dataclass(frozen=True)
class Topic:
    """key: with {rig}, {viewer} or {service} and {id} to fill in.  rate: rough messages per second, 0 for on change."""

    name: str
    key: str
    message: type[m.Message]
    queueing: Queueing
    rate: str

    def on(self, rig: str, **names: str) -> str:
        """The key expression of this topic; a name left out stands for all (`*`)."""
        return self.key.format_map({"rig": rig, "viewer": "*", "service": "*", "id": "*"} | names)


PARTIAL_BDP = Topic("partial_bdp", "zenocap/{rig}/viewer/{viewer}/bdp", m.PartialBdp, Queueing.KEPT, "on change")
SIGHTING = Topic("sighting", "zenocap/{rig}/viewer/{viewer}/sighting", m.Sighting, Queueing.LATEST, "every frame")
PARTIAL_BAP = Topic("partial_bap", "zenocap/{rig}/viewer/{viewer}/bap", m.PartialBap, Queueing.LATEST, "every frame")
SILHOUETTE = Topic(
    "silhouette", "zenocap/{rig}/viewer/{viewer}/silhouette", m.Silhouette, Queueing.LATEST, "every frame"
)
PREVIEW = Topic("preview", "zenocap/{rig}/viewer/{viewer}/preview", m.Preview, Queueing.LATEST, "at most 5 Hz")
CAMERA = Topic("camera", "zenocap/{rig}/viewer/{viewer}/camera", m.CameraInfo, Queueing.KEPT, "on change")
UNIVERSAL_BDP = Topic("universal_bdp", "zenocap/{rig}/integrator/bdp", m.UniversalBdp, Queueing.KEPT, "on change")
ASSIGNMENT = Topic("assignment", "zenocap/{rig}/integrator/assignment", m.Assignment, Queueing.LATEST, "every frame")
UNIVERSAL_BAP = Topic("universal_bap", "zenocap/{rig}/integrator/bap", m.UniversalBap, Queueing.ALL, "every frame")
HEALTH = Topic("health", "zenocap/{rig}/{service}/{id}/health", m.Health, Queueing.LATEST, "1 Hz")

TOPICS = (
    PARTIAL_BDP,
    SIGHTING,
    PARTIAL_BAP,
    SILHOUETTE,
    PREVIEW,
    CAMERA,
    UNIVERSAL_BDP,
    ASSIGNMENT,
    UNIVERSAL_BAP,
    HEALTH,
)

ALIVE = "zenocap/{rig}/alive/{service}/{id}"  # liveliness token
CLOCK = "zenocap/{rig}/integrator/clock"  # queryable: the integrator's clock
EVERYTHING = "zenocap/{rig}/**"
