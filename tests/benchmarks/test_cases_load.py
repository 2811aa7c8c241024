"""Limits of a rig that is offered twice what it can do."""

from math import inf

import pytest

from benchmarks.cases.speed.load import overload_figures
from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.resources import MachineUse


@pytest.mark.parametrize(
    ("completed", "latency_ms", "expected"),
    [
        (960, {"p99": 75.0}, {"whole": 80.0, "p99": 3.0, "holds": 1.0}),
        (948, {"p99": 25.0}, {"whole": 79.0, "p99": 1.0, "holds": 0.0}),
        (1200, {"p99": 80.0}, {"whole": 100.0, "p99": 3.2, "holds": 0.0}),
        (0, {}, {"whole": 0.0, "p99": inf, "holds": 0.0}),
    ],
)
def test_whole_frame_sets_and_their_delay_have_limits(
    completed: int, latency_ms: dict[str, float], expected: dict[str, float]
) -> None:
    found = Figures(2400, completed, 0, 0, 160.0, 64.0, latency_ms, {}, {}, 0.0, ())
    point = Measurement(Plan(viewers=4, rate=40.0, method="hybrid"), found, (), MachineUse(2, 1.9, 0.1), 5.0, 60.0, 0)
    assert overload_figures(point, 20.0) == pytest.approx(expected)
