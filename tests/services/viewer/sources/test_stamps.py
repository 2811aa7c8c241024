"""Capture times of cameras and streams, and the rate of a source."""

import numpy as np
import pytest

from zenocap.services.viewer.sources.stamps import SourceRate, StreamClock, buffer_age_ns

S, MS = 1_000_000_000, 1_000_000


def test_the_age_of_a_buffer_is_that_of_the_monotonic_clock_and_0_for_another_clock():
    assert buffer_age_ns(5_000.0, 5 * S + 12 * MS) == 12 * MS
    assert buffer_age_ns(0.0, S // 2) == 0  # no stamp
    assert buffer_age_ns(1.7e12, 5 * S) == 0  # of the wall clock
    assert buffer_age_ns(1_000.0, 5 * S) == 0  # of a clock that began later


def received(own_ns: np.ndarray, seed: int, delay_ms: float, jitter_ms: float) -> np.ndarray:
    """Times of receipt: a constant delay and an exponential jitter, in order."""
    jitter = np.random.default_rng(seed).exponential(jitter_ms, len(own_ns))
    return np.maximum.accumulate(own_ns + ((delay_ms + jitter) * MS).astype(np.int64)) + 100 * S


@pytest.mark.parametrize("seed", range(5))
def test_jitter_of_the_network_is_removed_after_a_while(seed):
    own = (np.arange(900) * S / 30).astype(np.int64)
    arrivals, clock = received(own, seed, 40.0, 20.0), StreamClock()
    found = np.array([clock.captured_ns(int(a), int(b)) for a, b in zip(own, arrivals, strict=True)])
    assert (found <= arrivals).all()
    errors = (found - own - 100 * S - 40 * MS)[330:] / MS
    assert 0 <= errors.min() <= errors.max() < 5.0  # of jitter that has a 95th percentile of 60 ms
    assert (found[:300] == arrivals[:300]).all()


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_times_from_an_assumed_rate_are_not_used(factor):
    own = (np.arange(900) * S / 30).astype(np.int64)
    arrivals, clock = received(own, 1, 40.0, 5.0), StreamClock()
    assert all(clock.captured_ns(int(a * factor), int(b)) == b for a, b in zip(own, arrivals, strict=True))


def test_a_stream_that_begins_again_or_has_no_times_is_stamped_on_receipt():
    clock = StreamClock()
    for k in range(600):
        clock.captured_ns(k * S // 30, k * S // 30 + S)
    assert clock.captured_ns(5, 30 * S) == 30 * S
    assert clock.captured_ns(5 + S // 30, 30 * S + S // 30 + 9) == 30 * S + S // 30 + 9
    still = StreamClock()
    assert [still.captured_ns(0, k * S) for k in range(30)] == [k * S for k in range(30)]


def test_rate_and_jitter_of_a_source():
    rate = SourceRate()
    assert rate.counts() == {"source_returns": 0}
    for k in range(100):
        rate.add(round(k * S / 25) + (4 * MS if k % 2 else 0))
    counts = rate.counts()
    assert counts["source_frames_per_1000_s"] == pytest.approx(25_000, rel=0.01)
    assert counts["source_jitter_us"] == 8000
    rate.restart()
    assert rate.counts() == {"source_returns": 1}
