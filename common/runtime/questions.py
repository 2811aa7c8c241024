"""What a service asks the others for, and when: the integrator's clock, and what it had said before it was restarted."""

from collections.abc import Collection

from common.bus.protocol import Bus
from common.topics import Topic

FAST_TRIPS, FAST_TRIP_NS = 10, 100_000_000  # the first round trips
TRIP_NS = 1_000_000_000  # between the later ones
RECALL_NS = 250_000_000  # between two questions, as long as there is something to recall


class Questions:
    """keeps_time: this is the integrator, whose own clock is the one."""

    def __init__(self, bus: Bus, now_ns: int, *, keeps_time: bool) -> None:
        self._bus, self._keeps_time = bus, keeps_time
        self._trips = 0
        self._trip_ns = self._recall_ns = now_ns

    def ask(self, now_ns: int, recalls: Collection[Topic]) -> None:
        """Ask what is due.  now_ns: from any start, never backwards.  recalls: what the service would know again."""
        if now_ns >= self._trip_ns and not self._keeps_time:
            self._bus.ask_clock()
            self._trips += 1
            self._trip_ns = now_ns + (FAST_TRIP_NS if self._trips < FAST_TRIPS else TRIP_NS)
        if recalls and now_ns >= self._recall_ns:
            for topic in recalls:
                self._bus.recall(topic)
            self._recall_ns = now_ns + RECALL_NS
