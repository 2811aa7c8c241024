"""When a message is due: order is kept, intervals are scaled, a pause takes no place, a seek changes nothing else."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from services.takes.replay.schedule import RATES, Playhead, faster, slower

NS = st.integers(min_value=0, max_value=10**15)
RATE = st.floats(min_value=0.01, max_value=1000)
HEADS = st.builds(Playhead, NS, NS, RATE)


@given(HEADS, st.lists(NS, min_size=2))
def test_messages_are_due_in_the_order_of_their_places(head: Playhead, places: list[int]) -> None:
    due = [head.due_ns(place) for place in sorted(places)]
    assert all(after >= before for before, after in pairwise(due))


@given(HEADS, NS, NS)
def test_intervals_are_scaled_by_the_rate(head: Playhead, first: int, second: int) -> None:
    one, two = (head.place_ns + ahead for ahead in sorted((first, second)))
    assert abs((head.due_ns(two) - head.due_ns(one)) - (two - one) / head.rate) <= max(2, 1e-9 * (two - one) / head.rate)


@given(HEADS, NS)
def test_a_place_is_reached_when_it_is_due(head: Playhead, ahead: int) -> None:
    place = head.place_ns + ahead
    assert abs(head.place_at(head.due_ns(place)) - place) <= max(2.0, 2 * head.rate, 1e-9 * ahead)


@given(HEADS, NS)
def test_what_lies_behind_is_due_at_once(head: Playhead, behind: int) -> None:
    assert head.due_ns(max(0, head.place_ns - behind)) == head.anchor_ns


@given(HEADS, NS, NS, NS)
def test_a_pause_takes_no_place(head: Playhead, until: int, paused_for: int, ahead: int) -> None:
    paused_ns = head.anchor_ns + until
    paused = head.toggled(paused_ns)
    assert paused.due_ns(head.place_ns) is None
    assert paused.place_at(paused_ns + paused_for) == head.place_at(paused_ns)
    resumed = paused.toggled(paused_ns + paused_for)
    place = head.place_at(paused_ns) + ahead
    assert abs((resumed.due_ns(place) - head.due_ns(place)) - paused_for) <= max(2.0, 2 / head.rate, 1e-9 * place)


@given(HEADS, NS, RATE)
def test_another_rate_goes_on_from_the_same_place(head: Playhead, until: int, rate: float) -> None:
    now_ns = head.anchor_ns + until
    changed = head.at_rate(rate, now_ns)
    assert changed.place_at(now_ns) == head.place_at(now_ns)
    assert changed.rate == rate


@given(HEADS, NS, NS, st.booleans())
def test_a_seek_moves_and_keeps_rate_and_pause(head: Playhead, place: int, until: int, paused: bool) -> None:
    now_ns = head.anchor_ns + until
    before = head.toggled(now_ns) if paused else head
    moved = before.moved(place, now_ns)
    assert moved.place_at(now_ns) == place
    assert (moved.rate, moved.paused) == (head.rate, paused)


@given(NS, NS, NS, NS)
def test_without_a_clock_everything_is_due(place: int, anchor: int, other: int, later: int) -> None:
    head = Playhead(place, anchor, 0.0)
    assert head.due_ns(other) == anchor
    assert head.place_at(anchor + later) == place
    assert head.toggled(later).due_ns(other) is None


def test_rates_are_chosen_step_by_step() -> None:
    assert [faster(rate) for rate in RATES[:-1]] == list(RATES[1:])
    assert [slower(rate) for rate in RATES[1:]] == list(RATES[:-1])
    assert (faster(RATES[-1]), slower(RATES[0])) == (RATES[-1], RATES[0])
    assert (faster(1.5), slower(1.5)) == (2.0, 1.0)
    assert (faster(0.0), slower(0.0)) == (0.0, RATES[-1])
