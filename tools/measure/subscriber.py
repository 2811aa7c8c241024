"""The measuring subscriber: receives the results, the views and the health of all rigs of a load.

Arrival times are taken when a message is queued, on Zenoh's thread of this process; its later handling does not count.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from time import monotonic

from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.closable import Closable
from zenocap.common.messages import Health, Phase, Sighting, Silhouette, TrackerPose, UniversalBap
from zenocap.common.rig.methods import method_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.topics import HEALTH
from zenocap.tools.measure.latency import Arrivals
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.resources import ProcessKey


class LoadSubscriber(Closable):
    """Raises BusError."""

    def __init__(self, plan: Plan, options: ZenohOptions, stopped: Callable[[], bool]) -> None:
        self._plan = plan
        self._clock = RealClock()
        self.arrivals = Arrivals()
        self.healths: defaultdict[ProcessKey, list[tuple[int, Health]]] = defaultdict(list)
        self._own = ZenohBus.open(options, plan.rig_names[0], self._clock, stopped)
        self._bus = self._own.listener(f"zenocap/{plan.name}-$*/**")
        method = method_of(plan.method)
        results, views = method.poses, method.sends[0]
        for topic in (results, views, HEALTH):
            self._bus.subscribe(topic, every=True)

    def close(self) -> None:
        self._bus.close()
        self._own.close()

    @property
    def now_ns(self) -> int:
        return self._clock.now_ns()

    @property
    def dropped(self) -> int:
        """Messages dropped because they arrived faster than they were handled here."""
        return sum(self._bus.counters.dropped.values())

    def receive_for(self, seconds: float) -> None:
        """Handle messages for a number of seconds."""
        end_s = monotonic() + seconds
        while (left_s := end_s - monotonic()) > 0:
            event = self._bus.receive(left_s)
            if isinstance(event, Envelope):
                self._take(event)

    def _take(self, event: Envelope) -> None:
        rig = event.key.split("/")[1]
        match event.message:
            case UniversalBap(frame=frame, stale=stale, scores=scores) if scores:  # the first pose is based on no view
                self.arrivals.pose(rig, frame, event.received_ns, whole=not stale)
            case TrackerPose(frame=frame):
                self.arrivals.pose(rig, frame, event.received_ns, whole=True)
            case Sighting(viewer=viewer, frame=frame) | Silhouette(viewer=viewer, frame=frame):
                count = self._plan.viewers if self._plan.until == "silhouette" else 0
                self.arrivals.view(rig, viewer, frame, event.received_ns, count)
            case Health(service=service, id=id) as health:
                self.healths[rig, service, id].append((event.received_ns, health))
            case _:
                pass

    def health_between(self, start_ns: int, end_ns: int) -> dict[ProcessKey, list[Health]]:
        """Health reports of each service between two times: means are taken of all; `RigView` has the last alone."""
        return {
            key: [health for ns, health in reports if start_ns <= ns <= end_ns] for key, reports in self.healths.items()
        }

    def texts(self, rigs: Sequence[str]) -> list[str]:
        """The last health text of the services of `rigs`, without viewers that publish silhouettes."""
        newest = {key: reports[-1][1] for key, reports in sorted(self.healths.items()) if reports and key[0] in rigs}
        return [
            f"{rig} {service}: {printable(health.state)}"
            for (rig, service, _), health in newest.items()
            if service != "viewer" or health.phase is not Phase.SEGMENTING
        ]

    def discard(self, before_ns: int) -> None:
        """Drop arrivals and reports before a time, to bound the memory of a soak."""
        for reports in self.healths.values():
            reports[:] = [(ns, health) for ns, health in reports if ns >= before_ns]
        for by_rig in (self.arrivals.whole, self.arrivals.partial):
            for frames in by_rig.values():
                for frame in [frame for frame, ns in frames.items() if ns < before_ns]:
                    del frames[frame]
        for views in self.arrivals.views.values():
            for frame in [frame for frame, times in views.items() if max(times.values()) < before_ns]:
                del views[frame]
