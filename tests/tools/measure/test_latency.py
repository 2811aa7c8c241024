"""Latency and loss: every frame set that was due counts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.tools.measure.latency import EDGES_MS, Arrivals, DueWindow, figures, percentiles

S = 1_000_000_000
EPOCH = 100 * S


def all_received(window: DueWindow, delay_ms: float, rig: str = "r") -> Arrivals:
    arrivals = Arrivals()
    for frame in window.frames:
        arrivals.pose(rig, frame, window.due_ns(frame) + round(delay_ms * 1e6), whole=True)
    return arrivals


def window(seconds: float = 2.0, rate: float = 30.0) -> DueWindow:
    return DueWindow(EPOCH, rate, EPOCH + S, EPOCH + S + round(seconds * 1e9))


@given(st.integers(0, 5 * S), st.integers(1, 3 * S), st.integers(0, 3 * S), st.floats(1.0, 240.0))
def test_neighbouring_windows_share_no_frame_set_and_miss_none(start: int, first: int, second: int, rate: float) -> None:
    middle, end = EPOCH + start + first, EPOCH + start + first + second
    one, two = DueWindow(EPOCH, rate, EPOCH + start, middle), DueWindow(EPOCH, rate, middle, end)
    assert list(one.frames) + list(two.frames) == list(DueWindow(EPOCH, rate, EPOCH + start, end).frames)


def test_latency_counts_from_the_due_time() -> None:
    found = figures(all_received(window(), 12.0), window(), ["r"], 2)
    assert (found.offered, found.completed, found.lost, found.partial) == (60, 60, 0, 0)
    assert found.latency_ms["p50"] == found.latency_ms["max"] == pytest.approx(12.0)
    assert found.offered_fps == found.completed_fps == pytest.approx(60.0)  # of both viewers
    assert found.held(1 / 30)
    assert not found.held(1 / 100)  # 12 ms are more than its period


def test_a_frame_set_that_never_arrives_is_lost() -> None:
    arrivals = all_received(window(), 5.0)
    missing = window().frames[10]
    del arrivals.whole["r"][missing]
    found = figures(arrivals, window(), ["r"], 2)
    assert (found.completed, found.lost) == (59, 1)
    assert not found.held(1 / 30)
    arrivals.pose("r", missing, 0, whole=False)
    assert figures(arrivals, window(), ["r"], 2).partial == 1
    assert figures(arrivals, window(), ["r", "other"], 2).lost == 60


def test_a_growing_delay_is_a_backlog() -> None:
    one = window(10.0)
    arrivals = Arrivals()
    for number, frame in enumerate(one.frames):
        arrivals.pose("r", frame, one.due_ns(frame) + number * 1_000_000, whole=True)
    found = figures(arrivals, one, ["r"], 2)
    assert found.growth_ms == pytest.approx(240.0, abs=1.0)
    assert not found.held(1.0 / 5)


def test_a_frame_set_of_silhouettes_is_complete_with_its_last_view() -> None:
    arrivals, one = Arrivals(), window()
    frame = one.frames[0]
    for viewer, delay_ms in (("2", 3), ("1", 9), ("1", 50)):
        arrivals.view("r", viewer, frame, one.due_ns(frame) + delay_ms * 1_000_000, count=2)
    found = figures(arrivals, one, ["r"], 2)
    assert found.completed == 1
    assert found.latency_ms["max"] == pytest.approx(9.0)
    assert found.skew_ms["max"] == pytest.approx(6.0)
    assert found.view_ms["p50"] == pytest.approx(6.0)


@given(st.lists(st.floats(0.0, 20_000.0), min_size=1, max_size=59))
def test_the_histogram_has_every_frame_set_once(delays_ms: list[float]) -> None:
    one, arrivals = window(), Arrivals()
    for frame, delay_ms in zip(one.frames, delays_ms, strict=False):
        arrivals.pose("r", frame, one.due_ns(frame) + round(delay_ms * 1e6), whole=True)
    histogram = figures(arrivals, one, ["r"], 2).histogram
    assert sum(histogram) == len(delays_ms)
    assert len(histogram) == len(EDGES_MS) + 1
    assert histogram[-1] == sum(round(delay * 1e6) / 1e6 >= EDGES_MS[-1] for delay in delays_ms)


@given(st.lists(st.floats(0.0, 1e4), min_size=1))
def test_percentiles_are_ordered(values: list[float]) -> None:
    named = percentiles(values)
    ordered = [named[name] for name in ("p50", "p95", "p99", "p99.9", "max")]
    assert ordered == sorted(ordered)
    assert percentiles([]) == {}
