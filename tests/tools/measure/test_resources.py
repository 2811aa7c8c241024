"""Resources by service, and the bottleneck among them."""

from collections.abc import Mapping
from dataclasses import replace

import pytest

from tests.support.built_messages import built
from zenocap.common.messages import Health
from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.resources import ITSELF, Cost, MachineUse, ProcessSample, bottleneck, costs

VIEWER, INTEGRATOR = ("load-1", "viewer", "1"), ("load-1", "integrator", "main")
HELD = Figures(60, 60, 0, 0, 60.0, 60.0, {"p50": 5.0, "p99": 9.0}, {}, {}, 0.0, ())
LOSING = replace(HELD, completed=50, lost=10)
FREE = MachineUse(8, 1.0, 0.5)


def health(busy: float, cores: float, counts: Mapping[str, int]) -> Health:
    return built(
        Health, rate=30.0, stages_ms={"step_frame": 3.5}, counts=dict(counts), cores=cores, busy=busy, memory_bytes=7,
    )  # fmt: skip


def sample(at_s: float, processor_s: float, pid: int = 1) -> ProcessSample:
    return ProcessSample(pid, at_s, processor_s, 100, 20, 5)


def test_cores_are_measured_for_local_processes_and_taken_from_health_for_others() -> None:
    health_messages = {VIEWER: [health(0.5, 0.9, {}), health(0.7, 0.9, {})], INTEGRATOR: [health(0.1, 0.3, {})]}
    integrator, viewer = costs({VIEWER: sample(0.0, 1.0)}, {VIEWER: sample(10.0, 3.0)}, health_messages)
    assert (viewer.cores, viewer.busy, viewer.memory_bytes, viewer.handles, viewer.threads) == (0.2, 0.6, 100, 20, 5)
    assert (integrator.cores, integrator.memory_bytes, integrator.handles) == (0.3, 7, 0)


def test_a_restarted_process_is_not_compared_with_its_predecessor() -> None:
    (cost,) = costs({VIEWER: sample(0.0, 50.0, pid=1)}, {VIEWER: sample(10.0, 0.1, pid=2)}, {})
    assert cost.cores == 0.0


def test_losses_count_within_the_measured_time() -> None:
    counts = ({"dropped_frames": 100}, {"dropped_frames": 103, "frames": 9})
    (cost,) = costs({}, {}, {VIEWER: [health(0.5, 0.5, each) for each in counts]})
    assert cost.lost == {"dropped_frames": 3}


def test_a_full_machine_is_the_bottleneck_with_its_largest_user() -> None:
    service_costs = [Cost(VIEWER, 1.5, 0, stages_ms={"step_frame": 9.0}), Cost(INTEGRATOR, 0.2, 0)]
    words = bottleneck(Plan(), LOSING, service_costs, MachineUse(2, 1.8, 0.2))
    assert words.startswith("the processor: 2.0 of 2 cores used (1.8 by the load)")
    assert "viewer (1.50 cores together, longest stage step_frame 9.0 ms)" in words
    assert "other processes" in bottleneck(Plan(), LOSING, service_costs, MachineUse(2, 0.3, 1.7))


BUSY = Cost(VIEWER, 0.5, 0, busy=0.97, stages_ms={"step_frame": 9.0, "result_age": 99.0})
DROPPING = Cost(VIEWER, 0.1, 0, busy=0.1, lost={"dropped_frames": 3})


@pytest.mark.parametrize(
    ("found", "service_costs", "words"),
    [
        pytest.param(
            LOSING, [BUSY, Cost(INTEGRATOR, 0.6, 0)],
            "load-1 viewer 1: its loop is busy 97% of the time, 0.50 cores; longest stage step_frame 9.0 ms", id="busy",
        ),
        pytest.param(LOSING, [Cost(ITSELF, 0.9, 0), Cost(VIEWER, 0.1, 0)], "the measuring process", id="measuring"),
        pytest.param(
            LOSING, [DROPPING, Cost(INTEGRATOR, 0.2, 0)],
            "load-1 viewer 1, which dropped (frames 3) although its loop is busy 10% only: it was delayed", id="delayed",
        ),
        pytest.param(
            HELD, [Cost(VIEWER, 0.1, 0, busy=0.1), Cost(INTEGRATOR, 0.2, 0, busy=0.4)],
            "none yet; closest to its limit is load-1 integrator", id="held",
        ),
        pytest.param(HELD, [], "unknown: no service reported", id="silent"),
    ],
)  # fmt: skip
def test_the_bottleneck_of_a_free_machine(found: Figures, service_costs: list[Cost], words: str) -> None:
    assert bottleneck(Plan(), found, service_costs, FREE).startswith(words)
