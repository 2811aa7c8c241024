"""Readers of one or several rigs on one connection, for programs that only watch."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack
from typing import Self

from zenocap.common.bus.protocol import Received
from zenocap.common.bus.zenoh_bus import MAX_RIGS, ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.queries import PeriodicQueries
from zenocap.common.topics import Topic

SEARCH_NS = 2_000_000_000  # period of the search for rigs; chosen by hand
BATCH = 256  # events of a rig between two looks at the others; chosen by hand


class Watch:
    """A reader of each rig, with presence and the clock of its integrator; it publishes nothing."""

    def __init__(
        self, options: ZenohOptions, name: str, rigs: Collection[str], topics: Sequence[Topic], stopped: Callable[[], bool],
        *, every: bool = False, clock: bool = False, admitted: Callable[[Collection[str]], Sequence[str]] = sorted,
    ) -> None:  # fmt: skip
        """Open the connection.  Raises BusError, and ValueError for a bad name.

        name: of the program.  rigs: empty for MAX_RIGS that are found on the network.  every: receive each message of
        LATEST topics.  clock: query the integrators' clocks.  admitted: of found rigs, those that are read.
        """
        self._clock = RealClock()
        self._topics, self._every, self._asks, self._admitted = tuple(topics), every, clock, admitted
        self._stack = ExitStack()
        self._own = self._stack.enter_context(ZenohBus.open(options, f"zenocap-{name}", self._clock, stopped))
        self._search, self._search_ns = not rigs, self._clock.elapsed_ns()
        self._readers: dict[str, tuple[ZenohBus, PeriodicQueries]] = {}
        for rig in rigs:
            self._read(rig)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def events(self) -> Iterator[tuple[str, Received, int]]:
        """The queued events with their rig and the time on this process's monotonic clock; waits for none."""
        now_ns = self._clock.elapsed_ns()
        if self._search and now_ns >= self._search_ns:
            self._search_ns = now_ns + SEARCH_NS
            new = self._admitted(self._own.rigs() - self._readers.keys())
            for rig in new[: max(0, MAX_RIGS - len(self._readers))]:
                self._read(rig)
        for rig, (reader, queries) in self._readers.items():
            if self._asks:
                queries.ask(now_ns, ())
            for _ in range(BATCH):
                event = reader.receive(0.0)
                if event is None:
                    break
                yield rig, event, self._clock.elapsed_ns()

    def _read(self, rig: str) -> None:
        reader = self._stack.enter_context(self._own.reader_of(rig))
        for topic in self._topics:
            reader.subscribe(topic, every=self._every)
        reader.watch_alive()
        self._readers[rig] = reader, PeriodicQueries(reader, self._clock.elapsed_ns(), keeps_time=False)
