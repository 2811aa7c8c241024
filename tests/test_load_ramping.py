"""Growing a load until something gives."""

from dataclasses import replace

import pytest

from services.load.costs import Cost, Used
from services.load.heard import Figures
from services.load.plan import LoadError, Plan, PlanError
from services.load.point import Point
from services.load.ramping import in_words, ramp

START = Plan(rate=30.0, seconds=5.0)


def point(plan: Plan, held: bool, seconds: float = 5.0) -> Point:
    found = Figures(10, 10 if held else 9, 0, 0 if held else 1, 1.0, 1.0, {"p99": 0.1}, {}, {}, 0.0, ())
    cost = Cost(("load-1", "viewer", "1"), 0.5, 0, busy=0.5)
    return Point(plan, found, (cost,), Used(8, 0.5, 0.0), 1.0, seconds, 0)


def measure_up_to(limit: float):
    return lambda plan: point(plan, plan.rate <= limit)


def test_the_largest_below_the_first_that_gave_is_found() -> None:
    seen: list[Point] = []
    found = ramp(START, "rate", measure_up_to(100.0), lambda: False, seen.append)
    assert tuple(seen) == found.points
    assert [p.plan.rate for p in found.points] == [30.0, 60.0, 120.0, 84.9, 100.9, 92.6]
    assert found.largest_held is not None
    assert found.largest_held.plan.rate == 92.6
    assert found.first_that_gave is not None
    assert found.first_that_gave.plan.rate == 100.9
    held, gave = in_words(found)
    assert held.startswith("held: 2 viewers, 92.6 frames/s")
    assert gave.startswith("gave: 2 viewers, 100.9 frames/s")


def test_nothing_that_holds_is_said() -> None:
    found = ramp(START, "rate", measure_up_to(1.0), lambda: False, lambda _: None)
    assert len(found.points) == 1
    assert in_words(found)[0].startswith("nothing held")


def test_a_plan_that_cannot_grow_ends_the_ramp_and_one_that_cannot_be_is_an_error() -> None:
    found = ramp(START, "viewers", lambda plan: point(plan, True), lambda: False, lambda _: None)
    assert [p.plan.viewers for p in found.points] == [2]  # two-view has two
    with pytest.raises(PlanError):
        ramp(replace(START, viewers=4), "rate", lambda plan: point(plan, True), lambda: False, lambda _: None)


def test_a_load_that_does_not_start_ends_the_ramp_with_what_was_measured() -> None:
    def measure(plan: Plan) -> Point:
        if plan.rigs > 2:
            raise LoadError("no pose")
        return point(plan, True)

    found = ramp(START, "rigs", measure, lambda: False, lambda _: None)
    assert [p.plan.rigs for p in found.points] == [1, 2]
    assert found.failure == "rigs 4: no pose"
    assert in_words(found)[-1] == "ended: rigs 4: no pose"


def test_a_point_that_was_cut_short_says_nothing() -> None:
    stopping = False

    def measure(plan: Plan) -> Point:
        nonlocal stopping
        stopping = plan.rate > 30.0
        return point(plan, not stopping, 1.0 if stopping else 5.0)

    found = ramp(START, "rate", measure, lambda: stopping, lambda _: None)
    assert [p.plan.rate for p in found.points] == [30.0]
