"""A peer of the rig: real poses, the health of its services, and nothing of strangers."""

import threading
from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

from benchmarks.chaos.schedule import SKEWED_NS
from zenocap.common import messages as m
from zenocap.common.bus.protocol import BusError, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.rig.services import title
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import (
    HEALTH,
    PARTIAL_BAP,
    POSTURE,
    REQUEST,
    SIGHTING,
    SILHOUETTE,
    TRACKER_POSE,
    UNIVERSAL_BAP,
    Queueing,
    service_at,
    topic_at,
)

SETTLED = 5  # consecutive poses that count as recovered
GAP_NS = 500_000_000  # largest interval between two of them
REAL_AGE_NS = 10_000_000_000  # messages of other times are forged ones
Place = tuple[str, str]  # of messages: topic and service, such as "silhouette" and "viewer 1"


@dataclass(frozen=True)
class SeenPose:
    """received_ns: by the observer.  lost: the person is searched for.  views: number of viewers used."""

    received_ns: int
    captured_ns: int
    frame: int
    lost: bool
    views: int


@dataclass(frozen=True)
class SeenFrame:
    """A message of a capture time, such as the silhouette or the sighting of a frame."""

    received_ns: int
    captured_ns: int
    frame: int


@dataclass(frozen=True)
class SeenHealth:
    """service: such as "viewer 1"."""

    received_ns: int
    service: str
    health: m.Health


class Observer(threading.Thread):
    """Collects poses and health from `start` to `close`, and publishes requests.

    frames: collects frames and postures too.  messages: all that it has received of the services.
    """

    def __init__(
        self, endpoint: str, rig: str, viewers: Collection[str], services: Collection[str], *, frames: bool = False
    ) -> None:
        super().__init__(name="observer", daemon=True)
        self._options = ZenohOptions("client", (endpoint,), multicast_scouting=False)
        self._rig, self._viewers, self._services = rig, frozenset(viewers), frozenset(services)
        self._clock = RealClock()
        self._ended = threading.Event()
        self._requests: list[m.Request] = []
        self.poses: list[SeenPose] = []
        self.frames: dict[str, list[SeenFrame]] = {viewer: [] for viewer in viewers} if frames else {}
        self.health: list[SeenHealth] = []
        self.messages: dict[Place, list[SeenFrame]] = defaultdict(list)
        self.sent: list[tuple[int, str]] = []  # requests: time, and what they ask for
        self.dropped = 0
        self.problem: str | None = None

    def request(self, what: str) -> None:
        """Publish a valid request, as any member of an open network may."""
        request = m.Request(frame=len(self.sent), captured_ns=self._clock.now_ns(), what=what)  # type: ignore[arg-type]
        self._requests.append(request)

    def close(self) -> None:
        self._ended.set()
        self.join(10.0)

    def run(self) -> None:
        try:
            with ZenohBus.open(self._options, self._rig, self._clock, self._ended.is_set) as bus:
                frames = (SILHOUETTE, SIGHTING, PARTIAL_BAP, POSTURE) if self.frames else ()
                for topic in (TRACKER_POSE, UNIVERSAL_BAP, *frames):
                    bus.subscribe(topic, every=True)
                bus.subscribe(HEALTH)
                while not self._ended.is_set():
                    while self._requests:
                        request = self._requests.pop(0)
                        bus.publish(REQUEST, request)
                        self.sent.append((self._clock.now_ns(), request.what))
                    event = bus.receive(0.1)
                    if isinstance(event, Envelope):
                        self._take(event)
                    self.dropped = bus.counters.dropped.get("queue_full", 0)
        except BusError as error:
            self.problem = str(error)

    def _take(self, event: Envelope) -> None:
        place, message = place_at(event.key), event.message
        if place is not None and place[1] in self._services and is_real(message.captured_ns, event.received_ns):
            self.messages[place].append(SeenFrame(event.received_ns, message.captured_ns, message.frame))
        match message:
            case m.TrackerPose(views=views) as pose if self._is_real(pose, views):
                seen = SeenPose(event.received_ns, pose.captured_ns, pose.frame, pose.lost, len(views))
                self.poses.append(seen)
            case m.UniversalBap(views=views) as pose if self._is_real(pose, views):
                fresh = len(self._viewers) - len(pose.stale)
                self.poses.append(SeenPose(event.received_ns, pose.captured_ns, pose.frame, "person" in pose.lost, fresh))
            case m.Silhouette(viewer=viewer) | m.Sighting(viewer=viewer) as seen_frame if viewer in self.frames:
                self.frames[viewer].append(SeenFrame(event.received_ns, seen_frame.captured_ns, seen_frame.frame))
            case m.Health(service=service, id=id) as health:
                name = service if id == "main" else f"{service} {id}"
                if name in self._services and abs(health.captured_ns - event.received_ns) < REAL_AGE_NS:
                    self.health.append(SeenHealth(event.received_ns, name, health))
            case _:
                pass

    def _is_real(self, pose: m.TrackerPose | m.UniversalBap, views: Collection[str]) -> bool:
        recent = abs(pose.captured_ns - self._clock.now_ns()) < REAL_AGE_NS
        return recent and bool(views) and self._viewers.issuperset(views)


def place_at(key: str) -> Place | None:
    """The place of a message that its service counts as sent; None for others."""
    topic, service = topic_at(key), service_at(key)
    if topic is None or service is None or topic.queueing is Queueing.LATCHED:
        return None
    return topic.name, title(service)


def is_real(captured_ns: int, received_ns: int) -> bool:
    """Whether a message is of its time, and no skewed copy of another one."""
    return abs(captured_ns - received_ns) < REAL_AGE_NS and captured_ns % 1_000_000 != SKEWED_NS


def settled_ns(poses: Collection[SeenPose], since_ns: int, views: int = 0) -> int | None:
    """Time of the first of SETTLED consecutive poses of `views` viewers received after `since_ns`; None without any."""
    row: list[SeenPose] = []
    for pose in poses:
        if pose.received_ns < since_ns:
            continue
        wanted = not pose.lost and pose.views >= views
        if not wanted or (row and pose.received_ns - row[-1].received_ns > GAP_NS):
            row = []
        if wanted:
            row.append(pose)
        if len(row) >= SETTLED:
            return row[0].received_ns
    return None


def longest_gap_s(poses: Collection[SeenPose], begin_ns: int, end_ns: int) -> float:
    """Longest time without a pose that is not lost between two times (s)."""
    times = [pose.received_ns for pose in poses if begin_ns <= pose.received_ns <= end_ns and not pose.lost]
    row = [begin_ns, *times, end_ns]
    return max(later - earlier for earlier, later in pairwise(row)) / 1e9
