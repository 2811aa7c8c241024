"""Offset of a machine's clock to the integrator's, from round trips.  Pure: times are arguments.

A round trip bounds the offset: the integrator answered between sending and receipt, so this clock minus the
integrator's is within half the round trip of its middle.  The shortest recent round trip gives the tightest bound;
older ones widen by the possible drift of the clocks.
"""

from dataclasses import dataclass

from zenocap.common.bus.protocol import RoundTrip
from zenocap.common.messages import Health

WINDOW = 32  # round trips that are kept, chosen by hand
DRIFT = 100e-6  # relative, of two free-running quartz clocks at 50 ppm each


@dataclass(frozen=True)
class Offset:
    """This clock minus the integrator's, and its largest error, nanoseconds."""

    offset_ns: int
    error_ns: int


@dataclass(frozen=True)
class ClockFilter:
    """The recent round trips, oldest first; their bounds overlap."""

    trips: tuple[RoundTrip, ...] = ()


def observe(state: ClockFilter, trip: RoundTrip) -> ClockFilter:
    """The filter with one more round trip.

    A round trip whose bound contradicts the earlier ones means that a clock was set: the earlier ones are dropped.  One
    with a receipt before its sending is ignored.
    """
    if trip.received_ns < trip.sent_ns:
        return state
    known, new = offset_at(state, trip.received_ns), _bound(trip, trip.received_ns)
    if known and abs(known.offset_ns - new.offset_ns) > known.error_ns + new.error_ns:
        return ClockFilter((trip,))
    return ClockFilter((*state.trips, trip)[-WINDOW:])


def offset_at(state: ClockFilter, now_ns: int) -> Offset | None:
    """The tightest bound on the offset at `now_ns` of this clock; None before the first round trip."""
    if not state.trips:
        return None
    return min((_bound(trip, now_ns) for trip in state.trips), key=lambda bound: bound.error_ns)


def _bound(trip: RoundTrip, now_ns: int) -> Offset:
    half_ns = (trip.received_ns - trip.sent_ns + 1) // 2
    return Offset(-trip.ahead_ns, half_ns + int(DRIFT * abs(now_ns - trip.received_ns)))


def offset_in(health: Health) -> Offset | None:
    """Clock offset in a health message; None before the first round trip (an error of 0 ns cannot be measured)."""
    return Offset(health.clock_offset_ns, health.clock_error_ns) if health.clock_error_ns else None


def to_integrator_ns(captured_ns: int, offset: Offset | None) -> int:
    """Capture time on the integrator's clock, at least 0; unchanged while the offset is unknown."""
    return max(0, captured_ns - offset.offset_ns) if offset else captured_ns


def clock_warning(name: str, offset: Offset, frame_ns: int) -> str | None:
    """Warning when a clock offset or its error exceeds a quarter of `frame_ns`; None otherwise.

    name: of the service or machine that has the clock, for display.
    """
    limit_ms = frame_ns / 4e6
    offset_ms, error_ms = offset.offset_ns / 1e6, offset.error_ns / 1e6
    if error_ms > limit_ms:
        return (
            f"{name}: its clock is known only within {error_ms:.1f} ms, more than a quarter frame "
            f"({limit_ms:.1f} ms): frames may be paired wrongly; the network to it is too slow"
        )
    if abs(offset_ms) > limit_ms:
        return (
            f"{name}: its clock is {abs(offset_ms):.1f} ms {'ahead of' if offset_ms > 0 else 'behind'} the "
            f"integrator's, more than a quarter frame ({limit_ms:.1f} ms): corrected, but let NTP set the clocks"
        )
    return None
