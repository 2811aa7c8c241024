"""Ramp: increases a load to the first failure."""

from dataclasses import replace

import pytest

from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.load_plan import LoadError, Plan, PlanError
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.ramp import ramp, ramp_lines
from zenocap.tools.measure.resources import Cost, MachineUse

START = Plan(rate=30.0, seconds=5.0)


def point(plan: Plan, held: bool, seconds: float = 5.0) -> Measurement:
    found = Figures(10, 10 if held else 9, 0, 0 if held else 1, 1.0, 1.0, {"p99": 0.1}, {}, {}, 0.0, ())
    cost = Cost(("load-1", "viewer", "1"), 0.5, 0, busy=0.5)
    return Measurement(plan, found, (cost,), MachineUse(8, 0.5, 0.0), 1.0, seconds, 0)


def ramped(what, measure=lambda plan: point(plan, held=True), start=START, stopped=lambda: False):
    """A ramp, and its points as they were reported."""
    seen: list[Measurement] = []
    found = ramp(start, what, measure, stopped, seen.append)
    assert tuple(seen) == found.points
    return found


def up_to(limit: float):
    return lambda plan: point(plan, plan.rate <= limit)


def test_the_largest_load_below_the_first_that_failed_is_found() -> None:
    found = ramped("rate", up_to(100.0))
    assert [p.plan.rate for p in found.points] == [30.0, 60.0, 120.0, 84.9, 100.9, 92.6]
    assert (found.largest_held.plan.rate, found.smallest_failed.plan.rate) == (92.6, 100.9)
    held, failed = ramp_lines(found)
    assert held.startswith("held: 2 viewers, 92.6 frames/s")
    assert failed.startswith("not held: 2 viewers, 100.9 frames/s")


def test_a_ramp_without_a_held_load_is_reported() -> None:
    found = ramped("rate", up_to(1.0))
    assert len(found.points) == 1
    assert ramp_lines(found)[0].startswith("not held: even the first load")


def test_the_largest_allowed_plan_ends_the_ramp_and_an_impossible_start_is_an_error() -> None:
    assert [p.plan.viewers for p in ramped("viewers").points] == [2]  # two-view has two
    with pytest.raises(PlanError):
        ramped("rate", start=replace(START, viewers=4))


def test_a_load_that_does_not_start_ends_the_ramp_and_keeps_its_results() -> None:
    def measure(plan: Plan) -> Measurement:
        if plan.rigs > 2:
            raise LoadError("no pose")
        return point(plan, True)

    found = ramped("rigs", measure)
    assert [p.plan.rigs for p in found.points] == [1, 2]
    assert found.failure == "rigs 4: no pose"
    assert ramp_lines(found)[-1] == "ended: rigs 4: no pose"


def test_an_interrupted_measurement_does_not_count() -> None:
    stopping = False

    def measure(plan: Plan) -> Measurement:
        nonlocal stopping
        stopping = plan.rate > 30.0
        return point(plan, not stopping, 1.0 if stopping else 5.0)

    assert [p.plan.rate for p in ramped("rate", measure, stopped=lambda: stopping).points] == [30.0]
