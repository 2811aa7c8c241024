"""Limits of a rig that is offered twice what it can do."""

from math import inf

import pytest

from benchmarks.cases.speed.load import overload_figures
from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.load_plan import MAX_RATE, Plan
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.resources import MachineUse


@pytest.mark.parametrize(
    ("most", "held", "completed", "latency_ms", "expected"),
    [
        (1200, 5.0, 960, {"p99": 75.0}, {"capacity": 20.0, "whole": 80.0, "p99": 3.0, "holds": 1.0}),
        (1200, 5.0, 948, {"p99": 25.0}, {"capacity": 20.0, "whole": 79.0, "p99": 1.0, "holds": 0.0}),
        (600, 20.0, 1200, {"p99": 80.0}, {"capacity": 20.0, "whole": 100.0, "p99": 3.2, "holds": 0.0}),
        (1200, 0.0, 0, {}, {"capacity": 20.0, "whole": 0.0, "p99": inf, "holds": 0.0}),
        (0, 0.0, 0, {}, {"capacity": 0.0, "whole": 0.0, "p99": inf, "holds": 0.0}),
    ],
)
def test_twice_what_comes_out_without_a_limit_is_offered_and_whole_sets_and_their_delay_have_limits(
    most: int, held: float, completed: int, latency_ms: dict[str, float], expected: dict[str, float]
) -> None:
    """Twice the rate that was held was offered, of which nearly all came out."""
    offered = list[float]()

    def measure(plan: Plan) -> Measurement:
        offered.append(plan.rate)
        whole, latency = (most, {"p99": 9.0} if most else {}) if plan.rate == MAX_RATE else (completed, latency_ms)
        found = Figures(2400, whole, 0, 0, 160.0, 64.0, latency, {}, {}, 0.0, ())
        return Measurement(plan, found, (), MachineUse(2, 1.9, 0.1), 5.0, 60.0, 0)

    assert overload_figures(Plan(viewers=4, rate=7.5, method="hybrid"), held, measure) == pytest.approx(expected)
    assert offered == [MAX_RATE, 40.0] if most else [MAX_RATE]
