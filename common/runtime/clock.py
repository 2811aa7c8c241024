"""Clocks as arguments, and how far a machine's clock is from the integrator's.

A round trip bounds the offset: the integrator answered between sending and receiving, so this clock minus the
integrator's lies within half the round trip of its middle.  The shortest recent round trip bounds it best; older ones
lose by the clocks' possible drift.
"""

import time
from dataclasses import dataclass
from typing import Protocol

from common.bus.protocol import RoundTrip
from common.messages import Health

WINDOW = 32  # round trips
DRIFT = 100e-6  # two free-running quartz clocks, relative


class Clock(Protocol):
    """now_ns: nanoseconds since the Unix epoch.  elapsed_ns: from any start, never backwards, for durations."""

    def now_ns(self) -> int: ...

    def elapsed_ns(self) -> int: ...


class RealClock:
    def now_ns(self) -> int:
        return time.time_ns()

    def elapsed_ns(self) -> int:
        return time.perf_counter_ns()


class ManualClock:
    """A clock that stands still unless told: for tests and for work without a network."""

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


@dataclass(frozen=True)
class Offset:
    """This clock minus the integrator's, and how far that can be wrong, nanoseconds."""

    offset_ns: int
    error_ns: int


@dataclass(frozen=True)
class ClockFilter:
    """The recent round trips, oldest first; all of them agree with one another."""

    trips: tuple[RoundTrip, ...] = ()


def observe(state: ClockFilter, trip: RoundTrip) -> ClockFilter:
    """The filter with one more round trip.

    A round trip that contradicts the earlier ones means that a clock was set: they are forgotten.  One that went back
    in time is ignored.
    """
    if trip.received_ns < trip.sent_ns:
        return state
    known, new = offset_at(state, trip.received_ns), _bound(trip, trip.received_ns)
    if known and abs(known.offset_ns - new.offset_ns) > known.error_ns + new.error_ns:
        return ClockFilter((trip,))
    return ClockFilter((*state.trips, trip)[-WINDOW:])


def offset_at(state: ClockFilter, now_ns: int) -> Offset | None:
    """The best bound on the offset at `now_ns`, this clock; None before the first round trip."""
    if not state.trips:
        return None
    return min((_bound(trip, now_ns) for trip in state.trips), key=lambda bound: bound.error_ns)


def _bound(trip: RoundTrip, now_ns: int) -> Offset:
    middle_ns = (trip.sent_ns + trip.received_ns) // 2
    half_ns = (trip.received_ns - trip.sent_ns + 1) // 2
    return Offset(middle_ns - trip.answered_ns, half_ns + int(DRIFT * abs(now_ns - trip.received_ns)))


def offset_in(health: Health) -> Offset | None:
    """What a service said of its clock; None while it does not know (an error of 0 ns cannot be measured)."""
    return Offset(health.clock_offset_ns, health.clock_error_ns) if health.clock_error_ns else None


def to_integrator_ns(captured_ns: int, offset: Offset | None) -> int:
    """A viewer's capture time by the integrator's clock; unchanged while the offset is unknown.  At least 0."""
    return max(0, captured_ns - offset.offset_ns) if offset else captured_ns


def clock_warning(viewer: str, offset: Offset, frame_ns: int) -> str | None:
    """What to tell the person when a viewer's clock, frames `frame_ns` apart, is off by more than a quarter frame."""
    limit_ms = frame_ns / 4e6
    offset_ms, error_ms = offset.offset_ns / 1e6, offset.error_ns / 1e6
    if error_ms > limit_ms:
        return (
            f"viewer {viewer}: its clock is known only within {error_ms:.1f} ms, more than a quarter frame "
            f"({limit_ms:.1f} ms): frames may be paired wrongly; the network to it is too slow"
        )
    if abs(offset_ms) > limit_ms:
        return (
            f"viewer {viewer}: its clock is {abs(offset_ms):.1f} ms {'ahead of' if offset_ms > 0 else 'behind'} the "
            f"integrator's, more than a quarter frame ({limit_ms:.1f} ms): corrected, but let NTP set the clocks"
        )
    return None
