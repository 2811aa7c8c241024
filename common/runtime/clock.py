"""Clocks as arguments: the machine's, and one set by its user."""

import time
from typing import Protocol


class Clock(Protocol):
    """now_ns: nanoseconds since the Unix epoch.  elapsed_ns: monotonic, from an arbitrary start, for durations."""

    def now_ns(self) -> int: ...

    def elapsed_ns(self) -> int: ...


class RealClock:
    """The clock of this machine."""

    def now_ns(self) -> int:
        return time.time_ns()

    def elapsed_ns(self) -> int:
        return time.perf_counter_ns()


class ManualClock:
    """A clock that is set by its user: for tests and for work without a network."""

    def __init__(self, now_ns: int = 0) -> None:
        self._now_ns = now_ns

    def now_ns(self) -> int:
        return self._now_ns

    def elapsed_ns(self) -> int:
        return self._now_ns

    def set(self, now_ns: int) -> None:
        self._now_ns = now_ns

    def advance(self, by_ns: int) -> None:
        self._now_ns += by_ns
