"""Measurements of a service in its Health message."""

from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest

from zenocap.common.bus.protocol import Counters
from zenocap.common.codec import decode, encode
from zenocap.common.messages import Health, Phase
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.runtime.health import MOST_COUNTS, RING, Meter, memory_bytes
from zenocap.common.topics import TOPICS

SECOND = 1_000_000_000
NO_COUNTERS = Counters(0, {}, {})


@pytest.fixture
def meter() -> Meter:
    return Meter("viewer", "1")


def reported(meter: Meter, at_s: int = 0, counters: Counters = NO_COUNTERS) -> Health:
    return meter.report(at_s * SECOND, at_s * SECOND, Phase.TRACKING, "tracking", counters, None)


def test_the_rate_counts_frames_or_without_them_messages_of_the_busiest_topic(meter: Meter) -> None:
    reported(meter)
    for _ in range(30):
        meter.publish("assignment")
    meter.publish("universal_bdp")
    assert reported(meter, 1).rate == 30.0
    assert reported(meter, 2).rate == 0.0
    for _ in range(30):
        meter.frame()
        meter.publish("sighting")
        meter.publish("sighting")
    assert reported(meter, 4).rate == 15.0


def test_the_time_of_a_stage_is_the_median_of_its_last_durations(meter: Meter) -> None:
    for _ in range(10):
        meter.time("step", 10**9)
    for _ in range(RING - 1):
        meter.time("step", 2_000_000)
    assert reported(meter).stages_ms == {"step": 2.0}


def test_health_has_all_counts() -> None:
    meter = Meter("viewer", "1", process=5)
    meter.counts["step_errors"] += 2
    bus = Counters(7, {"invalid": 1}, {"superseded": 3}, 9, sent={"health": 4})
    health = meter.report(5, 0, Phase.TRACKING, "tracking", bus, Offset(-4, 2))
    expected = {"step_errors": 2, "received": 7, "queued": 9, "rejected_invalid": 1, "dropped_superseded": 3}
    expected |= {"sent.health": 4, "process": 5}
    assert health.counts == expected
    assert (health.clock_offset_ns, health.clock_error_ns, health.state) == (-4, 2, "tracking")
    assert health.phase is Phase.TRACKING


def test_health_has_the_days_of_the_certificate_and_warns_before_the_expiry() -> None:
    def with_days(days: int | None) -> Health:
        return reported(Meter("viewer", "1"), 0, replace(NO_COUNTERS, certificate_days=days))

    assert "certificate_days" not in with_days(None).counts
    assert (with_days(31).counts["certificate_days"], with_days(31).state) == (31, "tracking")
    assert with_days(30).state == "tracking; certificate expires in 30 days"
    assert (with_days(-1).counts["certificate_days"], with_days(-1).state) == (0, "tracking; certificate has expired")


def test_health_with_too_many_values_is_a_valid_message(meter: Meter) -> None:
    for index in range(100):
        meter.counts[f"count{index}"] = index
        meter.time(f"stage{index}", 10**30)
    health = meter.report(0, 0, Phase.RUNNING, "x" * 5000, NO_COUNTERS, None)
    assert decode(encode(health), Health) == health


def test_what_is_needed_to_count_messages_is_never_left_out(meter: Meter) -> None:
    for index in range(100):
        meter.counts[f"count{index}"] = index
    meter.counts.update(step_errors=1, unsendable=2)
    sent = {topic.name: 3 for topic in TOPICS}
    counts = reported(meter, 0, Counters(0, {}, {}, sent=sent)).counts
    assert len(counts) == MOST_COUNTS
    assert {f"sent.{name}" for name in sent} | {"process", "step_errors", "unsendable"} <= counts.keys()


def test_two_processes_of_a_service_have_different_numbers() -> None:
    healths = [reported(Meter("viewer", "1")) for _ in range(10)]
    assert len({health.counts["process"] for health in healths}) == 10


def test_cores_are_processor_time_per_elapsed_time() -> None:
    used = iter([0, SECOND // 2, 2 * SECOND])
    meter = Meter("viewer", "1", lambda: next(used))
    assert reported(meter).cores == 0.0
    assert reported(meter, 3).cores == 0.5


def test_busy_is_the_fraction_of_time_in_steps_and_publishing(meter: Meter) -> None:
    reported(meter)
    meter.time("step_frame", SECOND)
    meter.time("publish", SECOND // 2)
    meter.time("frame_age", 100 * SECOND)
    assert reported(meter, 2).busy == 0.75
    assert reported(meter, 3).busy == 0.0


def test_memory_is_that_of_this_process_also_with_a_full_table_of_open_files(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 10 << 20 < memory_bytes() < 100 << 30
    monkeypatch.setattr(Path, "read_text", Mock(side_effect=OSError(24, "Too many open files")))
    assert memory_bytes() > 0
