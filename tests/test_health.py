"""What a service measures of itself fits into a Health message."""

from common.bus.protocol import Counters
from common.codec import decode, encode
from common.messages import Health
from common.runtime.clock import Offset
from common.runtime.health import RING, Meter, memory_bytes

SECOND = 1_000_000_000
QUIET = Counters(0, {}, {})


def test_the_rate_is_that_of_frames() -> None:
    meter = Meter("viewer", "1")
    meter.report(0, 0, "", QUIET, None)
    for _ in range(30):
        meter.frame()
        meter.publish("sighting")
        meter.publish("sighting")
    assert meter.report(2 * SECOND, 2 * SECOND, "", QUIET, None).rate == 15.0


def test_without_frames_the_rate_is_that_of_the_busiest_topic() -> None:
    meter = Meter("integrator", "main")
    meter.report(0, 0, "", QUIET, None)
    for _ in range(30):
        meter.publish("assignment")
    meter.publish("universal_bdp")
    assert meter.report(SECOND, SECOND, "", QUIET, None).rate == 30.0
    assert meter.report(2 * SECOND, 2 * SECOND, "", QUIET, None).rate == 0.0


def test_a_stage_is_the_median_of_its_last_durations() -> None:
    meter = Meter("viewer", "1")
    for _ in range(10):
        meter.time("step", 10**9)
    for _ in range(RING - 1):
        meter.time("step", 2_000_000)
    assert meter.report(0, 0, "", QUIET, None).stages_ms == {"step": 2.0}


def test_everything_counted_is_said() -> None:
    meter = Meter("viewer", "1")
    meter.counts["step_errors"] += 2
    health = meter.report(5, 0, "tracking", Counters(7, {"invalid": 1}, {"superseded": 3}), Offset(-4, 2))
    assert health.counts == {"step_errors": 2, "received": 7, "rejected_invalid": 1, "dropped_superseded": 3}
    assert (health.clock_offset_ns, health.clock_error_ns, health.state) == (-4, 2, "tracking")


def test_health_can_always_be_sent() -> None:
    meter = Meter("viewer", "1")
    for index in range(100):
        meter.counts[f"count{index}"] = index
        meter.time(f"stage{index}", 10**30)
    health = meter.report(0, 0, "x" * 5000, QUIET, None)
    assert decode(encode(health), Health) == health


def test_memory_is_that_of_this_process() -> None:
    assert 10 << 20 < memory_bytes() < 100 << 30


def test_cores_are_processor_time_over_time() -> None:
    used = iter([0, SECOND // 2, 2 * SECOND])
    meter = Meter("viewer", "1", lambda: next(used))
    assert meter.report(0, 0, "", QUIET, None).cores == 0.0
    assert meter.report(3 * SECOND, 3 * SECOND, "", QUIET, None).cores == 0.5


def test_busy_is_the_time_in_steps_and_publishing_alone() -> None:
    meter = Meter("viewer", "1")
    meter.report(0, 0, "", QUIET, None)
    meter.time("step_frame", SECOND)
    meter.time("publish", SECOND // 2)
    meter.time("frame_age", 100 * SECOND)
    assert meter.report(2 * SECOND, 2 * SECOND, "", QUIET, None).busy == 0.75
    assert meter.report(3 * SECOND, 3 * SECOND, "", QUIET, None).busy == 0.0
