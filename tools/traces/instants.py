"""The parts of an instant's way from the cameras to its pose, from the messages of the rig.

All times are on the integrator's clock: those of cameras are corrected by the offset in their viewer's health, those of
receipt by the offset of this machine.  A part ends when its message is received here, so that it includes the network.
"""

from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from zenocap.common.bus.protocol import Alive, Envelope, RoundTrip
from zenocap.common.messages import (
    Assignment,
    BothWaysPose,
    Health,
    PartialBap,
    Sighting,
    Silhouette,
    TrackerPose,
    UniversalBap,
)
from zenocap.common.runtime.clock_offset import ClockFilter, Offset, observe, offset_at, offset_in, to_integrator_ns
from zenocap.tools.traces.parameters import KEPT, MATCH_NS, MAX_AGE_NS, MOST_VIEWERS

Attribute = str | int | float | bool


@dataclass(frozen=True)
class Part:
    """A span.  service: that did the work, such as "viewer 1"."""

    service: str
    name: str
    begin_ns: int
    end_ns: int
    attributes: Mapping[str, Attribute] = field(default_factory=dict)


@dataclass(frozen=True)
class InstantWay:
    """whole: from the first camera to the pose.  parts: in between, in the order of their beginning."""

    whole: Part
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class _Heard:
    captured_ns: int
    received_ns: int


class Instants:
    """The messages of one rig; a way for every `every`-th pose."""

    def __init__(self, rig: str, every: int) -> None:
        self._rig, self._every, self._poses = rig, every, 0
        self._trips = ClockFilter()
        self._offsets: dict[str, Offset | None] = {}
        self._heard: defaultdict[tuple[str, str], deque[_Heard]] = defaultdict(lambda: deque(maxlen=KEPT))

    def receive(self, event: Envelope | Alive | RoundTrip) -> InstantWay | None:
        """Add an event; the way of a pose that is complete with it."""
        match event:
            case RoundTrip():
                self._trips = observe(self._trips, event)
            case Envelope(message=Health(service="viewer", id=id) as health):
                if id in self._offsets or len(self._offsets) < MOST_VIEWERS:
                    self._offsets[id] = offset_in(health)
            case Envelope(message=Silhouette(viewer=viewer) | Sighting(viewer=viewer) as message):
                self._add("seen", viewer, to_integrator_ns(message.captured_ns, self._offsets.get(viewer)), event)
            case Envelope(message=Assignment() as message):
                self._add("assigned", "", message.captured_ns, event)
            case Envelope(message=PartialBap(viewer=viewer) as message):
                self._add("limbs", viewer, to_integrator_ns(message.captured_ns, self._offsets.get(viewer)), event)
            case Envelope(message=TrackerPose() as message) if not isinstance(message, BothWaysPose):  # of a recorded one
                return self._way(message, event, "tracker")
            case Envelope(message=UniversalBap() as message):
                return self._way(message, event, "two-view")
            case _:
                pass
        return None

    def _add(self, kind: str, viewer: str, captured_ns: int, event: Envelope) -> None:
        if (kind, viewer) not in self._heard and len(self._heard) >= 3 * MOST_VIEWERS:
            return
        self._heard[kind, viewer].append(_Heard(captured_ns, self._received_ns(event)))

    def _received_ns(self, event: Envelope) -> int:
        return to_integrator_ns(event.received_ns, offset_at(self._trips, event.received_ns))

    def _way(self, pose: TrackerPose | UniversalBap, event: Envelope, source: str) -> InstantWay | None:
        self._poses += 1
        end_ns = self._received_ns(event)
        known = offset_at(self._trips, event.received_ns) is not None
        if (self._poses - 1) % self._every or not known or abs(end_ns - pose.captured_ns) > MAX_AGE_NS:
            return None
        seen = self._near("seen", pose.captured_ns)
        if not seen:
            return None
        parts = [
            Part(f"viewer {viewer}", "silhouette" if source == "tracker" else "silhouette and position", *_span(one))
            for viewer, one in seen.items()
        ]
        last_ns = max(one.received_ns for one in seen.values())
        if source == "tracker":
            parts.append(Part("tracker", "pose", last_ns, max(last_ns, end_ns)))
        else:
            parts += self._two_view_parts(pose.captured_ns, last_ns, end_ns)
        begin_ns = min(part.begin_ns for part in parts)
        lost = pose.lost if isinstance(pose.lost, bool) else "person" in pose.lost
        attributes: dict[str, Attribute] = {
            "zenocap.rig": self._rig,
            "zenocap.source": source,
            "zenocap.frame": pose.frame,
            "zenocap.views": len(seen),
            "zenocap.lost": lost,
        }
        return InstantWay(Part("rig", f"pose by {source}", begin_ns, max(begin_ns, end_ns), attributes), tuple(parts))

    def _two_view_parts(self, captured_ns: int, last_ns: int, end_ns: int) -> list[Part]:
        """Assignment, the search of arms and legs in each view, and the fusion."""
        parts: list[Part] = []
        assigned = self._near("assigned", captured_ns).get("")
        if assigned is not None:
            parts.append(Part("integrator", "assignment", last_ns, max(last_ns, assigned.received_ns)))
            last_ns = max(last_ns, assigned.received_ns)
        limbs = self._near("limbs", captured_ns)
        for viewer, one in limbs.items():
            parts.append(Part(f"viewer {viewer}", "arms and legs", last_ns, max(last_ns, one.received_ns)))
        last_ns = max([last_ns, *(one.received_ns for one in limbs.values())])
        return [*parts, Part("integrator", "fusion", last_ns, max(last_ns, end_ns))]

    def _near(self, kind: str, captured_ns: int) -> dict[str, _Heard]:
        """The nearest message of each viewer, by viewer, within MATCH_NS of a capture time."""
        found = {}
        for (one, viewer), heard in self._heard.items():
            if one == kind and heard:
                nearest = min(heard, key=lambda item: abs(item.captured_ns - captured_ns))
                if abs(nearest.captured_ns - captured_ns) <= MATCH_NS:
                    found[viewer] = nearest
        return found


def _span(one: _Heard) -> tuple[int, int]:
    return one.captured_ns, max(one.captured_ns, one.received_ns)
