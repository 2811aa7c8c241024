"""Periodic queries of a service: the integrator's clock, and its own last messages before a restart."""

from collections.abc import Collection

from zenocap.common.bus.protocol import Bus
from zenocap.common.topics import Topic

FAST_TRIPS, FAST_TRIP_NS = 10, 100_000_000  # number and period of the first round trips
TRIP_NS = 1_000_000_000  # period of the later ones
RECOVERY_NS = 250_000_000  # period of state recovery queries while state is missing, chosen by hand


class PeriodicQueries:
    """Clock and state queries of a service loop.  keeps_time: this is the integrator, whose clock is the reference."""

    def __init__(self, bus: Bus, now_ns: int, *, keeps_time: bool) -> None:
        self._bus, self._keeps_time = bus, keeps_time
        self._trips = 0
        self._trip_ns = self._recall_ns = now_ns

    def ask(self, now_ns: int, recovers: Collection[Topic]) -> None:
        """Send the queries that are due.  now_ns: monotonic time.  recovers: topics whose state the service lacks."""
        if now_ns >= self._trip_ns and not self._keeps_time:
            self._bus.query_clock()
            self._trips += 1
            self._trip_ns = now_ns + (FAST_TRIP_NS if self._trips < FAST_TRIPS else TRIP_NS)
        if recovers and now_ns >= self._recall_ns:
            for topic in recovers:
                self._bus.request_recovery(topic)
            self._recall_ns = now_ns + RECOVERY_NS
