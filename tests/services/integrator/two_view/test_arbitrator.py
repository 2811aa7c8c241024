"""The facade/flank arbitrator of [Two-view 4.3]: thresholds 0.2 and 0.3 throughout."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.services.integrator.two_view.arbitrator import Claim, View, arbitrate
from zenocap.services.viewer.two_view.silhouette_features import own_view

VIEWS = st.sampled_from(["facade", "flank"])
WIDTHS = st.floats(0.0, 1.0)


def other_than(view: View) -> View:
    return "flank" if view == "facade" else "facade"


def claim(before: View, width: float, low: float = 0.2, high: float = 0.3) -> Claim:
    """Claim of a viewer that measures this width."""
    return Claim(before, own_view(before, width, low, high), width, low, high)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        # (1) viewer 1 changes to facade, viewer 2 stays facade: |w1 - high1| > |w2 - low2| ?
        (("flank", 0.40), ("facade", 0.25), ("facade", "flank")),
        (("flank", 0.32), ("facade", 0.25), ("flank", "facade")),
        # (2) viewer 1 changes to flank, viewer 2 stays flank: |w1 - low1| > |w2 - high2| ?
        (("facade", 0.10), ("flank", 0.25), ("flank", "facade")),
        (("facade", 0.18), ("flank", 0.25), ("facade", "flank")),
        # (3) viewer 1 stays facade, viewer 2 changes to facade: |w1 - low1| >= |w2 - high2| sets viewer 2 back
        (("facade", 0.25), ("flank", 0.32), ("facade", "flank")),
        (("facade", 0.25), ("flank", 0.40), ("flank", "facade")),
        # (4) viewer 1 stays flank, viewer 2 changes to flank: |w1 - high1| >= |w2 - low2| sets viewer 2 back
        (("flank", 0.25), ("facade", 0.18), ("flank", "facade")),
        (("flank", 0.25), ("facade", 0.10), ("facade", "flank")),
        # both change, past the threshold out of their views: exchanged
        (("facade", 0.1), ("flank", 0.5), ("flank", "facade")),
        (("flank", 0.5), ("facade", 0.1), ("facade", "flank")),
        # no viewer changes
        (("facade", 0.4), ("flank", 0.1), ("facade", "flank")),
        (("flank", 0.25), ("facade", 0.25), ("flank", "facade")),
    ],
)
def test_the_papers_four_cases_and_changes_of_both_or_none(
    first: tuple[View, float], second: tuple[View, float], expected: tuple[View, View]
) -> None:
    assert arbitrate(claim(*first), claim(*second)) == expected


@pytest.mark.parametrize(("before", "mover", "stayer"), [("flank", 0.5, 0.5), ("facade", 0.25, 0.75)])
def test_a_tie_changes_nothing(before: View, mover: float, stayer: float) -> None:
    """Equal distances: the viewer that would change does not.  Quarters, so that distances are equal in binary."""
    other = other_than(before)
    low, high = (0.25, 0.375) if before == "flank" else (0.5, 1.0)
    moving, staying = claim(before, mover, low, high), claim(other, stayer, 0.375, 1.0 if before == "facade" else 0.5)
    assert moving.changes
    assert not staying.changes
    assert arbitrate(moving, staying) == (before, other)
    assert arbitrate(staying, moving) == (other, before)


@given(VIEWS, WIDTHS, WIDTHS)
def test_the_decision_is_one_of_each_view_independent_of_the_order_of_the_viewers_and_stable(
    before: View, one: float, two: float
) -> None:
    """Stable: repeating the same widths changes nothing."""
    other = other_than(before)
    first, second = claim(before, one), claim(other, two)
    views = arbitrate(first, second)
    assert set(views) == {"facade", "flank"}
    assert arbitrate(second, first)[::-1] == views
    if views != (before, other):
        assert arbitrate(claim(views[0], one), claim(views[1], two)) == views
