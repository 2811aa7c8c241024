"""The measuring subscriber: hears the results, the views and the health of all rigs of a load.

Times are taken when a message is queued, on Zenoh's thread of this process; what comes after does not count.
"""

from collections import defaultdict
from collections.abc import Callable
from time import monotonic

from common.bus.protocol import Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Health, Sighting, Silhouette, TrackerPose, UniversalBap
from common.runtime.clock import RealClock
from common.topics import HEALTH, SIGHTING, SILHOUETTE, TRACKER_POSE, UNIVERSAL_BAP
from services.load.heard import Heard
from services.load.plan import Plan
from services.load.processes import Who


class Listening:
    """Use it in a `with` statement.  Raises BusError."""

    def __init__(self, plan: Plan, options: ZenohOptions, stopped: Callable[[], bool]) -> None:
        self._plan = plan
        self._clock = RealClock()
        self.heard = Heard()
        self.healths: defaultdict[Who, list[tuple[int, Health]]] = defaultdict(list)
        self._own = ZenohBus.open(options, plan.rig_names[0], self._clock, stopped)
        self._bus = self._own.listener(f"zenocap/{plan.name}-$*/**")
        results = UNIVERSAL_BAP if plan.method == "two-view" else TRACKER_POSE
        views = SIGHTING if plan.method == "two-view" else SILHOUETTE
        for topic in (results, views, HEALTH):
            self._bus.subscribe(topic, every=True)

    def __enter__(self) -> "Listening":
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()
        self._own.close()

    @property
    def now_ns(self) -> int:
        return self._clock.now_ns()

    @property
    def dropped(self) -> int:
        """Messages that came faster than they were taken here."""
        return sum(self._bus.counters.dropped.values())

    def listen(self, seconds: float) -> None:
        """Take what comes for so long."""
        end_s = monotonic() + seconds
        while (left_s := end_s - monotonic()) > 0:
            event = self._bus.receive(left_s)
            if isinstance(event, Envelope):
                self._take(event)

    def _take(self, event: Envelope) -> None:
        rig = event.key.split("/")[1]
        match event.message:
            case UniversalBap(frame=frame, stale=stale, scores=scores) if scores:  # the first one has none: it is made up
                self.heard.pose(rig, frame, event.received_ns, whole=not stale)
            case TrackerPose(frame=frame):
                self.heard.pose(rig, frame, event.received_ns, whole=True)
            case Sighting(viewer=viewer, frame=frame) | Silhouette(viewer=viewer, frame=frame):
                count = self._plan.viewers if self._plan.until == "silhouette" else 0
                self.heard.view(rig, viewer, frame, event.received_ns, count)
            case Health(service=service, id=id) as health:
                self.healths[rig, service, id].append((event.received_ns, health))
            case _:
                pass

    def health_between(self, start_ns: int, end_ns: int) -> dict[Who, list[Health]]:
        """What each service said from then to then."""
        every = {who: [health for ns, health in said if start_ns <= ns <= end_ns] for who, said in self.healths.items()}
        return {who: said for who, said in every.items() if said}

    def forget(self, before_ns: int) -> None:
        """What was due, or said, before: a soak need not keep it."""
        for said in self.healths.values():
            said[:] = [(ns, health) for ns, health in said if ns >= before_ns]
        for by_rig in (self.heard.whole, self.heard.partial):
            for frames in by_rig.values():
                for frame in [frame for frame, ns in frames.items() if ns < before_ns]:
                    del frames[frame]
        for views in self.heard.views.values():
            for frame in [frame for frame, times in views.items() if max(times.values()) < before_ns]:
                del views[frame]
