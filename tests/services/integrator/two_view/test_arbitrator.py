"""The facade/flank arbitrator of [Two-view 4.3]: thresholds 0.2 and 0.3 throughout."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.services.integrator.two_view.arbitrator import Claim, View, arbitrate
from zenocap.services.viewer.two_view.silhouette_features import own_view

VIEWS = st.sampled_from(["facade", "flank"])
WIDTHS = st.floats(0.0, 1.0)


def claim(before: View, width: float, low: float = 0.2, high: float = 0.3) -> Claim:
    """Claim of a viewer that measures this width."""
    return Claim(before, own_view(before, width, low, high), width, low, high)


CLAIMS = st.builds(claim, VIEWS, WIDTHS)
CASES = [
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
]


@pytest.mark.parametrize(("first", "second", "expected"), CASES)
def test_the_papers_four_cases(first: tuple[View, float], second: tuple[View, float], expected: tuple[View, View]) -> None:
    assert arbitrate(claim(*first), claim(*second)) == expected


@pytest.mark.parametrize(("before", "mover", "stayer"), [("flank", 0.5, 0.5), ("facade", 0.25, 0.75)])
def test_a_tie_changes_nothing(before: View, mover: float, stayer: float) -> None:
    """Equal distances: the viewer that would change does not.  Quarters, so that distances are equal in binary."""
    other: View = "flank" if before == "facade" else "facade"
    low, high = (0.25, 0.375) if before == "flank" else (0.5, 1.0)
    moving, staying = claim(before, mover, low, high), claim(other, stayer, 0.375, 1.0 if before == "facade" else 0.5)
    assert moving.changes
    assert not staying.changes
    assert arbitrate(moving, staying) == (before, other)
    assert arbitrate(staying, moving) == (other, before)


@pytest.mark.parametrize("before", ["facade", "flank"])
def test_the_views_are_exchanged_when_both_viewers_change(before: View) -> None:
    other: View = "flank" if before == "facade" else "facade"
    width = {"facade": 0.1, "flank": 0.5}  # past the threshold out of that view
    assert arbitrate(claim(before, width[before]), claim(other, width[other])) == (other, before)


def test_the_views_are_kept_when_no_viewer_changes() -> None:
    assert arbitrate(claim("facade", 0.4), claim("flank", 0.1)) == ("facade", "flank")
    assert arbitrate(claim("flank", 0.25), claim("facade", 0.25)) == ("flank", "facade")


@given(VIEWS, WIDTHS, WIDTHS)
def test_viewers_never_hold_the_same_view(before: View, one: float, two: float) -> None:
    other: View = "flank" if before == "facade" else "facade"
    assert set(arbitrate(claim(before, one), claim(other, two))) == {"facade", "flank"}


@given(VIEWS, WIDTHS, WIDTHS)
def test_the_decision_is_independent_of_the_order_of_the_viewers(before: View, one: float, two: float) -> None:
    other: View = "flank" if before == "facade" else "facade"
    first, second = claim(before, one), claim(other, two)
    assert arbitrate(first, second) == arbitrate(second, first)[::-1]


@given(VIEWS, WIDTHS, WIDTHS)
def test_the_decision_is_stable(before: View, one: float, two: float) -> None:
    """Repeating the same widths changes nothing."""
    other: View = "flank" if before == "facade" else "facade"
    views = arbitrate(claim(before, one), claim(other, two))
    again = arbitrate(claim(views[0], one), claim(views[1], two))
    if views != (before, other):
        assert again == views
