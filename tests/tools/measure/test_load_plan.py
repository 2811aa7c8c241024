"""Validation of plans, and the values of a ramp."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.tools.measure.load_plan import MAX_RATE, MAX_RIGS, Plan, PlanError, checked
from zenocap.tools.measure.ramp import RampQuantity, next_value, scaled


def values_tried(what: RampQuantity, start: float, limit: float) -> list[tuple[float, bool]]:
    """Values that a ramp tries when all up to `limit` hold."""
    tried: list[tuple[float, bool]] = []
    while (value := next_value(what, start, tried)) is not None:
        tried.append((value, value <= limit))
        assert len(tried) < 40
    return tried


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (Plan(viewers=4), "--viewers 4"),
        (Plan(viewers=65, method="hybrid"), "--viewers 65"),
        (Plan(rigs=1000), "--rigs 1000"),
        (Plan(rate=2000.0), "--rate 2000"),
        (Plan(until="silhouette"), "--until silhouette"),
        (Plan(mesh=True, part="viewers"), "--mesh --part viewers"),
    ],
)
def test_an_impossible_plan_names_its_option(plan: Plan, words: str) -> None:
    with pytest.raises(PlanError, match=f"^{words}: allowed"):
        checked(plan)


def test_a_plan_names_its_rigs_and_views() -> None:
    plan = checked(Plan(viewers=3, rigs=2, method="hybrid", name="lab"))
    assert plan.rig_names == ("lab-1", "lab-2")
    assert plan.views == ("1", "2", "3")
    assert plan.has_tracker
    assert not replace(plan, until="silhouette").has_tracker


def test_scaling_changes_one_quantity() -> None:
    assert scaled(Plan(), "rate", 60.0) == replace(Plan(), rate=60.0)
    assert scaled(Plan(), "rigs", 4.0) == replace(Plan(), rigs=4)
    assert scaled(Plan(), "viewers", 8.0) == replace(Plan(), viewers=8)


@given(st.floats(10.0, MAX_RATE * 0.99))
def test_a_ramp_of_the_rate_ends_within_a_tenth_of_the_limit(limit: float) -> None:
    tried = values_tried("rate", 10.0, limit)
    best = max(value for value, held in tried if held)
    worst = min((value for value, held in tried if not held), default=MAX_RATE)
    assert best <= limit < max(worst, best + 1)
    assert worst / best < 1.12


@given(st.integers(1, MAX_RIGS))
def test_a_ramp_of_rigs_tries_whole_numbers_and_no_value_twice(limit: int) -> None:
    values = [value for value, _ in values_tried("rigs", 1, limit)]
    assert all(value == int(value) for value in values)
    assert len(values) == len(set(values))


def test_a_ramp_whose_start_does_not_hold_ends() -> None:
    assert next_value("rate", 30.0, [(30.0, False)]) is None
