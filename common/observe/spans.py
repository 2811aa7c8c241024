"""Latency spans of a frame set, from the messages of its rig: captured, seen, assigned, posed.

All times are on the integrator's clock: those of cameras are corrected by the offset in their viewer's health, those of
receipt by the offset of this machine.  A span ends when its message is received here, so that it includes the network.
"""

from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Envelope, RoundTrip
from zenocap.common.conversion import Bap, is_lost
from zenocap.common.observe.bodies import Source, source_of
from zenocap.common.runtime.clock_offset import ClockFilter, Offset, observe, offset_at, offset_in, to_integrator_ns

MATCH_NS: Final = 40_000_000  # capture times of the views of a frame set and of its pose; as synchronizers pair at 15 /s
KEPT: Final = 256  # messages of each kind and viewer that wait for their pose: 4 s at 60 frames/s
MAX_AGE_NS: Final = 60_000_000_000  # older poses are of a replayed take; chosen by hand
MOST_VIEWERS: Final = 64  # of a rig, as messages allow; further names are ignored

Attribute = str | int | float | bool


@dataclass(frozen=True)
class Span:
    """service: that did the work, such as "viewer 1"."""

    service: str
    name: str
    begin_ns: int
    end_ns: int
    attributes: Mapping[str, Attribute] = field(default_factory=dict)


@dataclass(frozen=True)
class FrameSetSpans:
    """whole: from the first camera to the pose.  parts: in between, in the order of their beginning."""

    whole: Span
    parts: tuple[Span, ...]


@dataclass(frozen=True)
class _Seen:
    captured_ns: int
    received_ns: int


def live_pose(message: m.Message) -> tuple[Source, Bap] | None:
    """A pose and its source; None for other messages, and for poses of a second pass, which are of the same frame sets."""
    source = source_of(message)
    if source is None or isinstance(message, m.BothWaysPose) or not isinstance(message, m.UniversalBap | m.TrackerPose):
        return None
    return source, message


def age_ns(pose: Bap, received_ns: int, trips: ClockFilter) -> int | None:
    """Time from the capture of a pose to its receipt; None while the clock is unknown, and for a pose of a replayed take.

    received_ns: of this clock.  trips: queries of the integrator's clock.
    """
    offset = offset_at(trips, received_ns)
    age = to_integrator_ns(received_ns, offset) - pose.captured_ns
    return None if offset is None or abs(age) > MAX_AGE_NS else age


class SpanReader:
    """The messages of one rig; spans for every `every`-th pose."""

    def __init__(self, rig: str, every: int) -> None:
        self._rig, self._every, self._poses = rig, every, 0
        self._trips = ClockFilter()
        self._offsets: dict[str, Offset | None] = {}
        self._seen: defaultdict[tuple[str, str], deque[_Seen]] = defaultdict(lambda: deque(maxlen=KEPT))

    def receive(self, event: Envelope | Alive | RoundTrip) -> FrameSetSpans | None:
        """Add an event; the spans of a pose that are complete with it."""
        match event:
            case RoundTrip():
                self._trips = observe(self._trips, event)
            case Envelope(message=m.Health(service="viewer", id=id) as health):
                if id in self._offsets or len(self._offsets) < MOST_VIEWERS:
                    self._offsets[id] = offset_in(health)
            case Envelope(message=m.Silhouette(viewer=viewer) | m.Sighting(viewer=viewer) as message):
                self._add("seen", viewer, to_integrator_ns(message.captured_ns, self._offsets.get(viewer)), event)
            case Envelope(message=m.Assignment() as message):
                self._add("assigned", "", message.captured_ns, event)
            case Envelope(message=m.PartialBap(viewer=viewer) as message):
                self._add("limbs", viewer, to_integrator_ns(message.captured_ns, self._offsets.get(viewer)), event)
            case Envelope():
                posed = live_pose(event.message)
                return None if posed is None else self._spans(*posed, event)
            case _:
                pass
        return None

    def _add(self, kind: str, viewer: str, captured_ns: int, event: Envelope) -> None:
        if (kind, viewer) not in self._seen and len(self._seen) >= 3 * MOST_VIEWERS:
            return
        self._seen[kind, viewer].append(_Seen(captured_ns, self._received_ns(event)))

    def _received_ns(self, event: Envelope) -> int:
        return to_integrator_ns(event.received_ns, offset_at(self._trips, event.received_ns))

    def _spans(self, source: Source, pose: Bap, event: Envelope) -> FrameSetSpans | None:
        self._poses += 1
        if (self._poses - 1) % self._every or age_ns(pose, event.received_ns, self._trips) is None:
            return None
        seen = self._near("seen", pose.captured_ns)
        if not seen:
            return None
        found = "silhouette" if source == "tracker" else "silhouette and position"
        parts = [
            Span(f"viewer {viewer}", found, one.captured_ns, max(one.captured_ns, one.received_ns))
            for viewer, one in seen.items()
        ]
        end_ns = self._received_ns(event)
        last_ns = max(one.received_ns for one in seen.values())
        if source == "tracker":
            parts.append(Span("tracker", "pose", last_ns, max(last_ns, end_ns)))
        else:
            parts += self._two_view_spans(pose.captured_ns, last_ns, end_ns)
        begin_ns = min(part.begin_ns for part in parts)
        attributes: dict[str, Attribute] = {
            "zenocap.rig": self._rig, "zenocap.source": source, "zenocap.frame": pose.frame, "zenocap.views": len(seen),
            "zenocap.lost": is_lost(pose),
        }  # fmt: skip
        return FrameSetSpans(Span("rig", f"pose by {source}", begin_ns, max(begin_ns, end_ns), attributes), tuple(parts))

    def _two_view_spans(self, captured_ns: int, last_ns: int, end_ns: int) -> list[Span]:
        """Assignment, the search of arms and legs in each view, and the fusion."""
        parts: list[Span] = []
        assigned = self._near("assigned", captured_ns).get("")
        if assigned is not None:
            parts.append(Span("integrator", "assignment", last_ns, max(last_ns, assigned.received_ns)))
            last_ns = max(last_ns, assigned.received_ns)
        limbs = self._near("limbs", captured_ns)
        for viewer, one in limbs.items():
            parts.append(Span(f"viewer {viewer}", "arms and legs", last_ns, max(last_ns, one.received_ns)))
        last_ns = max([last_ns, *(one.received_ns for one in limbs.values())])
        return [*parts, Span("integrator", "fusion", last_ns, max(last_ns, end_ns))]

    def _near(self, kind: str, captured_ns: int) -> dict[str, _Seen]:
        """The nearest message of each viewer, by viewer, within MATCH_NS of a capture time."""
        found = {}
        for (one, viewer), seen in self._seen.items():
            if one == kind and seen:
                nearest = min(seen, key=lambda item: abs(item.captured_ns - captured_ns))
                if abs(nearest.captured_ns - captured_ns) <= MATCH_NS:
                    found[viewer] = nearest
        return found
