"""Observations of the exporter: services, poses, latencies, capture times.

Latency and skew are on the integrator's clock: the exporter measures the offset of its own clock as a service does.
"""

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from statistics import median

from zenocap.common.bus.protocol import Alive, Envelope, RoundTrip
from zenocap.common.conversion import Bap, is_lost
from zenocap.common.messages import Handled, Health
from zenocap.common.observe.bodies import Source
from zenocap.common.observe.spans import age_ns, live_pose
from zenocap.common.observe.view import ObservedService, RigView, ServiceView, observed, rows, without
from zenocap.common.rig.services import ServiceKey, sort_key
from zenocap.common.runtime.clock_offset import Offset, offset_at, offset_in, to_integrator_ns
from zenocap.common.topics import NAME, SIGHTING, SILHOUETTE, topic_at
from zenocap.tools.operate.metrics import parameters as p

PAIRING: frozenset[ServiceKey] = frozenset({("integrator", "main"), ("tracker", "main")})  # their traces have all viewers


class Histogram:
    """Counts of values up to each of LATENCY_BUCKETS_S, not cumulative, the last of greater ones; their sum (s)."""

    def __init__(self) -> None:
        self.counts = [0] * (len(p.LATENCY_BUCKETS_S) + 1)
        self.sum_s = 0.0

    def add(self, value_s: float) -> None:
        self.counts[bisect_left(p.LATENCY_BUCKETS_S, value_s)] += 1
        self.sum_s += value_s


class RigObservations:
    """One rig.  expected: services of its rig file; others are admitted up to MAX_SERVICES.

    poses: by source, and whether the person was lost.  ignored: messages of services that were not admitted.
    """

    def __init__(self, rig: str, expected: Sequence[ServiceKey]) -> None:
        self.rig = rig
        self.poses: Counter[tuple[Source, bool]] = Counter()
        self.latency: dict[Source, Histogram] = {}
        self.ignored = 0
        self._expected = frozenset(expected)
        self._view = RigView(rig, tuple(expected))
        self._times_ns: dict[str, tuple[int, ...]] = {}  # capture times of viewers, of the last input trace

    def receive(self, event: Envelope | Alive | RoundTrip, now_ns: int) -> None:
        """Add an event.  now_ns: monotonic clock of this process."""
        match event:
            case RoundTrip():
                self._view = observed(self._view, event, now_ns)
            case Alive(service=service, id=id) | Envelope(message=Health(service=service, id=id)):
                if self._admitted((service, id), now_ns):
                    self._view = observed(self._view, event, now_ns)
                else:
                    self.ignored += 1
            case Envelope(message=Handled() as handled):
                if (handled.service, handled.id) in PAIRING:
                    self._set_times(handled)
            case Envelope(message=message, received_ns=received_ns):
                if (found := live_pose(message)) is not None:
                    self._add_pose(*found, received_ns)

    def services(self) -> Mapping[ServiceKey, ServiceView]:
        return self._view.services

    def rows(self, now_ns: int) -> Sequence[ObservedService]:
        """Status of every service, including missing ones of the rig file."""
        return rows(self._view, now_ns)

    def own_offset(self, now_ns: int) -> Offset | None:
        """This machine's clock minus the integrator's; None while unknown."""
        return offset_at(self._view.trips, now_ns)

    def skews_s(self) -> Mapping[str, float]:
        """Median distance (s) of each viewer's capture times from the nearest ones of the first viewer.

        Times are corrected by the clock offsets of the viewers.  Empty for fewer than two viewers.
        """
        corrected: dict[str, list[int]] = {}
        for viewer, times_ns in self._times_ns.items():
            state = self.services().get(("viewer", viewer))
            if state is not None and state.health is not None:
                offset = offset_in(state.health)
                corrected[viewer] = sorted(to_integrator_ns(time_ns, offset) for time_ns in times_ns)
        if len(corrected) < 2:
            return {}
        first = min(corrected, key=lambda viewer: sort_key(("viewer", viewer)))
        return {viewer: _skew_ns(times_ns, corrected[first]) / 1e9 for viewer, times_ns in corrected.items()}

    def forget(self, now_ns: int) -> None:
        """Remove services that are not of the rig file and have been silent for FORGET_NS."""
        old = [
            key for key, one in self._view.services.items()
            if key not in self._expected and now_ns - max(one.health_ns, one.since_ns) > p.FORGET_NS
        ]  # fmt: skip
        self._view = without(self._view, old)

    def _admitted(self, service: ServiceKey, now_ns: int) -> bool:
        if service in self._expected or service in self._view.services:
            return True
        if service[0] not in p.SERVICE_NAMES or not re.fullmatch(NAME, service[1]):
            return False
        self.forget(now_ns)
        others = sum(key not in self._expected for key in self._view.services)
        return others < p.MAX_SERVICES

    def _add_pose(self, source: Source, pose: Bap, received_ns: int) -> None:
        self.poses[source, is_lost(pose)] += 1
        age = age_ns(pose, received_ns, self._view.trips)
        if age is not None:
            self.latency.setdefault(source, Histogram()).add(max(0, age) / 1e9)

    def _set_times(self, handled: Handled) -> None:
        viewers: dict[int, str] = {}
        for number, key in enumerate(handled.keys):
            topic = topic_at(key)
            if topic is SILHOUETTE or topic is SIGHTING:
                viewer = (topic.names(key) or {}).get("viewer", "")
                if ("viewer", viewer) in self._view.services:
                    viewers[number] = viewer
        times_ns: dict[str, list[int]] = {}
        for number, time_ns in handled.events:
            if number in viewers:
                times_ns.setdefault(viewers[number], []).append(time_ns)
        if times_ns:
            self._times_ns = {viewer: tuple(times[-p.TIMES_KEPT :]) for viewer, times in times_ns.items()}


class Observations:
    """All rigs.  ignored: rigs that were not admitted, each time they were found."""

    def __init__(self, expected: Mapping[str, Sequence[ServiceKey]]) -> None:
        """expected: services of rig files, by rig; empty for all rigs that are found."""
        self.rigs = {rig: RigObservations(rig, services) for rig, services in expected.items()}
        self.ignored = 0

    def admit(self, found: Collection[str]) -> list[str]:
        """Add rigs that were found on the network, up to MAX_RIGS; return the new ones."""
        new = sorted(set(found) - self.rigs.keys())
        valid = [rig for rig in new if re.fullmatch(NAME, rig)]
        admitted = valid[: max(0, p.MAX_RIGS - len(self.rigs))]
        self.ignored += len(new) - len(admitted)
        self.rigs |= {rig: RigObservations(rig, ()) for rig in admitted}
        return admitted


def _skew_ns(times_ns: Sequence[int], reference_ns: Sequence[int]) -> float:
    """Median of time minus nearest time of the reference; both sorted, not empty."""
    found = []
    for time_ns in times_ns:
        after = bisect_left(reference_ns, time_ns)
        nearest = min(reference_ns[max(0, after - 1) : after + 1], key=lambda other_ns: abs(time_ns - other_ns))
        found.append(time_ns - nearest)
    return median(found)
