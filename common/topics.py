"""The table of keys: one row per topic.  No key string appears anywhere else."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache, lru_cache

import msgspec

from zenocap.common import messages as m

FRAME_HZ = 30.0  # frames per second of an ordinary camera


class Queueing(Enum):
    """Messages that a slow reader receives.  No topic may block its publisher."""

    LATCHED = "the last one, also when it joins late"
    LATEST = "the newest one of each key"
    ALL = "every one in order, up to the size of its queue"


@dataclass(frozen=True)
class Topic:
    """key: template with {rig}, {viewer} or {service} and {id}.

    rate_hz: messages per second and key, at most, of a rig at FRAME_HZ; 0 for on change.
    recoverable: readers keep the last message and return it to a restarted publisher.
    """

    name: str
    key: str
    message: type[m.Message]
    queueing: Queueing
    rate_hz: float
    recoverable: bool = False

    def on(self, rig: str, **names: str) -> str:
        """The key expression of this topic; a name left out stands for all (`*`)."""
        return self.key.format_map({"rig": rig, "viewer": "*", "service": "*", "id": "*"} | names)

    def at(self, rig: str, **names: str) -> str:
        """The one key of this topic with these names.  Raises ValueError for a name that is missing or no `Name`."""
        for field in _fields(self.key):
            checked_name(field, rig if field == "rig" else names.get(field, ""))
        return self.key.format_map({"rig": rig} | names)

    def names(self, key: str) -> Mapping[str, str] | None:
        """The names in `key`, `rig` among them; None when it is no key of this topic."""
        return _names(self.key, key)

    def names_of(self, message: m.Message) -> dict[str, str]:
        """The names in the message that belong into its key: its viewer, or its service and id."""
        return {field: getattr(message, field) for field in _fields(self.key) if hasattr(message, field)}


PARTIAL_BDP = Topic("partial_bdp", "zenocap/{rig}/viewer/{viewer}/bdp", m.PartialBdp, Queueing.LATCHED, 0)
SIGHTING = Topic("sighting", "zenocap/{rig}/viewer/{viewer}/sighting", m.Sighting, Queueing.LATEST, FRAME_HZ)
PARTIAL_BAP = Topic("partial_bap", "zenocap/{rig}/viewer/{viewer}/bap", m.PartialBap, Queueing.LATEST, FRAME_HZ)
SILHOUETTE = Topic("silhouette", "zenocap/{rig}/viewer/{viewer}/silhouette", m.Silhouette, Queueing.LATEST, FRAME_HZ)
PREVIEW = Topic("preview", "zenocap/{rig}/viewer/{viewer}/preview", m.Preview, Queueing.LATEST, 5)
CAMERA_ADVICE = Topic("camera_advice", "zenocap/{rig}/viewer/{viewer}/advice", m.CameraAdvice, Queueing.LATEST, 1)
CAMERA = Topic("camera", "zenocap/{rig}/viewer/{viewer}/camera", m.CameraInfo, Queueing.LATCHED, 0)
UNIVERSAL_BDP = Topic("universal_bdp", "zenocap/{rig}/integrator/bdp", m.UniversalBdp, Queueing.LATCHED, 0, True)
ASSIGNMENT = Topic("assignment", "zenocap/{rig}/integrator/assignment", m.Assignment, Queueing.LATEST, FRAME_HZ)
UNIVERSAL_BAP = Topic("universal_bap", "zenocap/{rig}/integrator/bap", m.UniversalBap, Queueing.ALL, FRAME_HZ, True)
TRACKER_BDP = Topic("tracker_bdp", "zenocap/{rig}/tracker/bdp", m.TrackerBdp, Queueing.LATCHED, 0, True)
TRACKER_POSE = Topic("tracker_pose", "zenocap/{rig}/tracker/pose", m.TrackerPose, Queueing.ALL, FRAME_HZ, True)
BOTH_WAYS_POSE = Topic("both_ways_pose", "zenocap/{rig}/tracker/both_ways", m.BothWaysPose, Queueing.ALL, FRAME_HZ)
VERDICT = Topic("verdict", "zenocap/{rig}/integrator/verdict", m.Verdict, Queueing.ALL, 0)
SCENE_POINTS = Topic("scene_points", "zenocap/{rig}/tracker/points", m.ScenePoints, Queueing.LATEST, 10)
POSTURE = Topic("posture", "zenocap/{rig}/recognizer/posture", m.Posture, Queueing.ALL, 0)
COMMAND = Topic("command", "zenocap/{rig}/recognizer/command", m.CommandResult, Queueing.ALL, 0)
HEALTH = Topic("health", "zenocap/{rig}/{service}/{id}/health", m.Health, Queueing.LATEST, 1)
HANDLED = Topic("handled", "zenocap/{rig}/{service}/{id}/handled", m.Handled, Queueing.ALL, 1)
FRAME_RATE = Topic("frame_rate", "zenocap/{rig}/integrator/frame_rate", m.FrameRate, Queueing.LATCHED, 0, True)
TRACKER_DETAIL = Topic("tracker_detail", "zenocap/{rig}/integrator/detail", m.TrackerDetail, Queueing.LATCHED, 0)
CAMERA_DELAYS = Topic("camera_delays", "zenocap/{rig}/integrator/delays", m.CameraDelays, Queueing.LATCHED, 0, True)
REQUEST = Topic("request", "zenocap/{rig}/request", m.Request, Queueing.ALL, 0)

TOPICS = (
    PARTIAL_BDP, SIGHTING, PARTIAL_BAP, SILHOUETTE, PREVIEW, CAMERA_ADVICE, CAMERA, UNIVERSAL_BDP, ASSIGNMENT,
    UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE, BOTH_WAYS_POSE, VERDICT, SCENE_POINTS, POSTURE, COMMAND, HEALTH, HANDLED,
    FRAME_RATE, TRACKER_DETAIL, CAMERA_DELAYS, REQUEST,
)  # fmt: skip

ALIVE = "zenocap/{rig}/alive/{service}/{id}"  # liveliness token
CLAIM = ALIVE + "/{claim}"  # token and queryable of one process: start time and session, the oldest is right
CLOCK = "zenocap/{rig}/integrator/clock"  # queryable: the integrator's clock
SERVICE_INFO = "zenocap/{rig}/about/{service}/{id}"  # queryable: the rig file and the versions of a service
FLOW_CONTROL = "zenocap/{rig}/pace/{service}/{id}"  # queryable: replies once everything sent before is handled
STATE_RECOVERY = "zenocap/{rig}/recall/{topic}"  # queryable of every reader: the last message, for a restarted publisher
REVOKED = "zenocap/{rig}/certificates/revoked"  # the signed list of revoked certificates, for routers
FILM = "zenocap/{rig}/film/viewer/{viewer}"  # queryable of a viewer: records the images of its camera
HOST_ALIVE = "zenocap-cameras/{machine}/alive"  # liveliness token of a camera host, which belongs to no rig
HOST_CAMERAS = "zenocap-cameras/{machine}/cameras"  # queryable: its cameras
HOST_FILM = "zenocap-cameras/{machine}/film/{camera}"  # queryable: records the images of one of them
HOST_ASSIGN = "zenocap-cameras/{machine}/assign/{camera}"  # queryable: runs a viewer of a rig with one of them
EVERYTHING = "zenocap/{rig}/**"
ROOT = "zenocap"  # the first chunk of every key
NAME = r"[A-Za-z0-9_.\-]{1,64}"  # what a name in a key may be, as `messages.Name` has it


def service_at(key: str) -> tuple[str, str] | None:
    """Service and id of the one that publishes on `key`; None when it is no key of a topic, or anybody may."""
    topic = topic_at(key)
    if topic is None or topic is REQUEST:
        return None
    names = topic.names(key) or {}
    return key.split("/")[2], names.get("viewer", names.get("id", "main"))


def is_of(services: Collection[tuple[str, str]], rig: str, names: Mapping[str, str] | None) -> bool:
    """Whether the names of a key are of these services of a rig, or of a topic of the rig that has one key."""
    match names:
        case {"rig": other} if other != rig:
            return False
        case {"viewer": id}:
            return ("viewer", id) in services
        case {"service": service, "id": id}:
            return (service, id) in services
        case _:
            return names is not None


@cache
def topic_of(message: type[m.Message]) -> Topic:
    """The topic that carries this type of message.  Raises ValueError when there is none."""
    for topic in TOPICS:
        if topic.message is message:
            return topic
    raise ValueError(f"{message.__name__} has no topic; known: {', '.join(t.message.__name__ for t in TOPICS)}")


@lru_cache(maxsize=4096)  # a take has few keys and many messages
def topic_at(key: str) -> Topic | None:
    """The topic that `key` belongs to, if any."""
    return next((topic for topic in TOPICS if topic.names(key) is not None), None)


def rig_of(expression: str) -> str | None:
    """The one rig that all keys under a key expression belong to; None when there may be several."""
    match expression.split("/"):
        case [root, rig, *_] if root == ROOT and re.fullmatch(NAME, rig):
            return rig
        case _:
            return None


def checked_name(field: str, value: str) -> str:
    """`value` when it may stand in a key.  Raises ValueError."""
    try:
        return msgspec.convert(value, m.Name)
    except msgspec.ValidationError:
        raise ValueError(f"{field} = {value!r}: 1 to 64 letters, digits, '_', '.' or '-' expected") from None


def is_name(value: str) -> bool:
    """Whether `value` may stand in a key."""
    return re.fullmatch(NAME, value) is not None


@cache
def _fields(template: str) -> tuple[str, ...]:
    return tuple(re.findall(r"{(\w+)}", template))


@lru_cache(maxsize=4096)  # a rig has few keys, and each comes with every frame
def _names(template: str, key: str) -> Mapping[str, str] | None:
    match = _pattern(template).fullmatch(key)
    return match.groupdict() if match else None


@cache
def _pattern(template: str) -> re.Pattern[str]:
    return re.compile(re.sub(r"{(\w+)}", r"(?P<\1>[^/]+)", template))
