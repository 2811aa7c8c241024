"""Clock filter: the reported error bounds the true error for any round trips."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from zenocap.common.bus.protocol import RoundTrip
from zenocap.common.messages import Health
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.clock_offset import (
    DRIFT,
    WINDOW,
    ClockFilter,
    Offset,
    clock_warning,
    observe,
    offset_at,
    offset_in,
    to_integrator_ns,
)

DELAYS = st.integers(0, 50_000_000)  # one way, nanoseconds
OFFSETS = st.integers(-(10**12), 10**12)
START_NS = 10**18


def trip(offset_ns: int, sent_ns: int, there_ns: int, back_ns: int) -> RoundTrip:
    """A round trip of a clock that is `offset_ns` ahead of the integrator's."""
    return RoundTrip(sent_ns, sent_ns + there_ns - offset_ns, sent_ns + there_ns + back_ns)


@given(OFFSETS, st.lists(st.tuples(DELAYS, DELAYS), min_size=1, max_size=50))
def test_the_true_offset_is_within_the_reported_error(offset_ns: int, delays: list[tuple[int, int]]) -> None:
    state, now_ns = ClockFilter(), START_NS
    for there_ns, back_ns in delays:
        state = observe(state, trip(offset_ns, now_ns, there_ns, back_ns))
        now_ns += 1_000_000_000
        found = offset_at(state, now_ns)
        assert abs(found.offset_ns - offset_ns) <= found.error_ns + 1
    assert len(state.trips) == min(len(delays), WINDOW)


@given(st.floats(-DRIFT, DRIFT), st.lists(st.tuples(DELAYS, DELAYS), min_size=1, max_size=50))
def test_the_offset_of_a_drifting_clock_is_within_the_reported_error(drift: float, delays: list[tuple[int, int]]) -> None:
    state = ClockFilter()
    for index, (there_ns, back_ns) in enumerate(delays):
        now_ns = START_NS + index * 1_000_000_000
        true_ns = int(drift * (now_ns - START_NS))
        state = observe(state, trip(true_ns, now_ns, there_ns, back_ns))
        found = offset_at(state, now_ns + there_ns + back_ns)
        assert abs(found.offset_ns - true_ns) <= found.error_ns + DRIFT * 1e8 + 2


def test_the_offset_is_that_of_the_shortest_round_trip() -> None:
    state = ClockFilter()
    for there_ns, back_ns in [(9_000_000, 1_000_000), (100_000, 120_000), (1_000_000, 30_000_000)]:
        state = observe(state, trip(5_000_000, START_NS, there_ns, back_ns))
    assert offset_at(state, START_NS) == Offset(5_010_000, 110_000 + int(DRIFT * 220_000))


def test_the_new_offset_is_used_at_once_after_a_clock_is_set() -> None:
    state = ClockFilter()
    for second in range(5):
        state = observe(state, trip(0, START_NS + second * 10**9, 100_000, 100_000))
    state = observe(state, trip(3_000_000_000, START_NS + 8 * 10**9, 5_000_000, 5_000_000))
    found = offset_at(state, START_NS + 8 * 10**9)
    assert abs(found.offset_ns - 3_000_000_000) <= found.error_ns
    assert len(state.trips) == 1


def test_there_is_no_offset_before_the_first_round_trip_and_one_that_ends_before_it_began_is_ignored() -> None:
    assert offset_at(ClockFilter(), START_NS) is None
    assert observe(ClockFilter(), RoundTrip(10, 5, 9)) == ClockFilter()


@pytest.mark.parametrize(
    ("captured_ns", "offset", "expected_ns"),
    [(START_NS, None, START_NS), (START_NS, Offset(5_000_000, 100), START_NS - 5_000_000), (3, Offset(5_000_000, 100), 0)],
)
def test_a_capture_time_is_converted_to_the_integrators_clock(captured_ns: int, offset: Offset, expected_ns: int) -> None:
    assert to_integrator_ns(captured_ns, offset) == expected_ns


@pytest.mark.parametrize(
    ("offset", "text"),
    [
        (Offset(20_000_000, 100_000), "20.0 ms ahead of the integrator's"),
        (Offset(-20_000_000, 100_000), "20.0 ms behind the integrator's"),
        (Offset(0, 20_000_000), "known only within 20.0 ms"),
    ],
)
def test_an_offset_or_error_above_a_quarter_frame_period_gives_a_warning(offset: Offset, text: str) -> None:
    warning = clock_warning("viewer 1", offset, 1_000_000_000 // 15)
    assert text in warning
    assert "viewer 1" in warning
    assert clock_warning("viewer 1", Offset(1_000_000, 100_000), 1_000_000_000 // 15) is None


def test_health_carries_the_offset() -> None:
    assert offset_in(built(Health)) is None
    assert offset_in(built(Health, clock_offset_ns=-7, clock_error_ns=3)) == Offset(-7, 3)


def test_a_manual_clock_changes_only_by_advance_and_set() -> None:
    clock = ManualClock(5)
    clock.advance(3)
    assert (clock.now_ns(), clock.elapsed_ns()) == (8, 8)
    clock.set(2)
    assert clock.now_ns() == 2
