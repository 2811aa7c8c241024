"""Laws of the facade/flank arbitrator, whose four cases are in `tests/test_papers.py`.  [Two-view 4.3]"""

from hypothesis import given
from hypothesis import strategies as st

from zenocap.services.integrator.two_view.arbitrator import Claim, View, arbitrate
from zenocap.services.viewer.two_view.silhouette_features import own_view

VIEWS = st.sampled_from(["facade", "flank"])
WIDTHS, LOW, HIGH = st.floats(0.0, 1.0), 0.2, 0.3


def other_than(view: View) -> View:
    return "flank" if view == "facade" else "facade"


def claim(before: View, width: float) -> Claim:
    """Claim of a viewer that measures this width."""
    return Claim(before, own_view(before, width, LOW, HIGH), width, LOW, HIGH)


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
