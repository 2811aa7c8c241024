"""Plans that can be, and what a ramp tries next."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.load.plan import MOST_RATE, MOST_RIGS, Grown, Plan, PlanError, checked, grown, next_value


def limit_found(what: Grown, start: float, limit: float) -> list[tuple[float, bool]]:
    """All that a ramp tries when everything up to `limit` holds."""
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
def test_a_plan_that_cannot_be_is_refused_by_its_option(plan: Plan, words: str) -> None:
    with pytest.raises(PlanError, match=f"^{words}: allowed"):
        checked(plan)


def test_a_plan_names_its_rigs_and_views() -> None:
    plan = checked(Plan(viewers=3, rigs=2, method="hybrid", name="lab"))
    assert plan.rig_names == ("lab-1", "lab-2")
    assert plan.views == ("1", "2", "3")
    assert plan.has_tracker
    assert not replace(plan, until="silhouette").has_tracker


def test_growing_changes_one_thing() -> None:
    assert grown(Plan(), "rate", 60.0) == replace(Plan(), rate=60.0)
    assert grown(Plan(), "rigs", 4.0) == replace(Plan(), rigs=4)
    assert grown(Plan(), "viewers", 8.0) == replace(Plan(), viewers=8)


@given(st.floats(10.0, MOST_RATE * 0.99))
def test_a_ramp_of_the_rate_ends_within_a_tenth_of_the_limit(limit: float) -> None:
    tried = limit_found("rate", 10.0, limit)
    best = max(value for value, held in tried if held)
    worst = min((value for value, held in tried if not held), default=MOST_RATE)
    assert best <= limit < max(worst, best + 1)
    assert worst / best < 1.12


@given(st.integers(1, MOST_RIGS))
def test_a_ramp_of_rigs_tries_whole_numbers_and_no_value_twice(limit: int) -> None:
    values = [value for value, _ in limit_found("rigs", 1, limit)]
    assert all(value == int(value) for value in values)
    assert len(values) == len(set(values))


def test_a_ramp_whose_start_does_not_hold_is_over() -> None:
    assert next_value("rate", 30.0, [(30.0, False)]) is None
