"""Pacing of a replay: position at any time, and precise waiting."""

from dataclasses import dataclass, replace
from time import sleep
from typing import Protocol

from zenocap.common.runtime.clock import Clock

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # rates selected by the keys + and -
MAX_RATE = 1000.0


@dataclass(frozen=True)
class Playhead:
    """Position of a replay: `place_ns` of its time line at `anchor_ns` of a monotonic clock.

    rate: seconds of the time line per second; 0 for no clock: everything is due at once.
    """

    place_ns: int
    anchor_ns: int
    rate: float = 1.0
    paused: bool = False

    def place_at(self, now_ns: int) -> int:
        if self.paused or not self.rate:
            return self.place_ns
        return self.place_ns + round((now_ns - self.anchor_ns) * self.rate)

    def due_ns(self, place_ns: int) -> int | None:
        """Clock time at which `place_ns` is reached, never before the anchor; None while paused."""
        if self.paused:
            return None
        if not self.rate:
            return self.anchor_ns
        return self.anchor_ns + max(0, round((place_ns - self.place_ns) / self.rate))

    def moved(self, place_ns: int, now_ns: int) -> "Playhead":
        """Playhead at another place from `now_ns` on."""
        return replace(self, place_ns=place_ns, anchor_ns=now_ns)

    def toggled(self, now_ns: int) -> "Playhead":
        """Playhead paused, or continued where it was paused."""
        return replace(self.moved(self.place_at(now_ns), now_ns), paused=not self.paused)

    def at_rate(self, rate: float, now_ns: int) -> "Playhead":
        """Playhead continued from the same place at another rate."""
        return replace(self.moved(self.place_at(now_ns), now_ns), rate=rate)


def faster(rate: float) -> float:
    """The next of RATES above; the rate itself above the last, and 0 (no clock) stays."""
    return next((choice for choice in RATES if choice > rate), rate) if rate else rate


def slower(rate: float) -> float:
    """The next of RATES below; the rate itself below the first.  From 0 (no clock) the fastest."""
    return next((choice for choice in reversed(RATES) if choice < rate), rate) if rate else RATES[-1]


# A sleep ends some 0.1 ms late; then the clock is polled.  Measured lateness (median and 99th percentile)
# and share of a core, playing 20 s of the demo on two shared cores: 0.07, 0.14 ms, 1 % without; 0.00, 0.09 ms, 2.5 % with
# 0.2 ms; 0.00, 0.01 ms, 10 % with 1 ms.
SPIN_NS = 200_000


class Timer(Protocol):
    """Precise waiting of the player."""

    def until(self, due_ns: int) -> None:
        """Return at `due_ns` of the clock's elapsed time, or at once when that is past."""


class RealTimer:
    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def until(self, due_ns: int) -> None:
        left_ns = due_ns - self._clock.elapsed_ns()
        if left_ns > SPIN_NS:
            sleep((left_ns - SPIN_NS) / 1e9)
        while self._clock.elapsed_ns() < due_ns:
            pass
