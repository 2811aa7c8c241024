"""Due times of messages: order, scaled intervals, pauses, seeks."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from zenocap.tools.record.replay.pacing import RATES, Playhead, faster, slower

NS = st.integers(min_value=0, max_value=10**15)
RATE = st.floats(min_value=0.01, max_value=1000)
HEADS = st.builds(Playhead, NS, NS, RATE)


@given(HEADS, st.lists(NS, min_size=2))
def test_messages_are_due_in_the_order_of_their_positions(head: Playhead, positions: list[int]) -> None:
    due = [head.due_ns(position) for position in sorted(positions)]
    assert all(after >= before for before, after in pairwise(due))


@given(HEADS, NS, NS)
def test_intervals_are_scaled_by_the_rate(head: Playhead, first: int, second: int) -> None:
    one, two = (head.place_ns + offset for offset in sorted((first, second)))
    assert abs((head.due_ns(two) - head.due_ns(one)) - (two - one) / head.rate) <= max(2, 1e-9 * (two - one) / head.rate)


@given(HEADS, NS)
def test_position_is_reached_at_its_due_time(head: Playhead, offset: int) -> None:
    position = head.place_ns + offset
    assert abs(head.place_at(head.due_ns(position)) - position) <= max(2.0, 2 * head.rate, 1e-9 * offset)


@given(HEADS, NS)
def test_earlier_positions_are_due_immediately(head: Playhead, earlier_by: int) -> None:
    assert head.due_ns(max(0, head.place_ns - earlier_by)) == head.anchor_ns


@given(HEADS, NS, NS, NS)
def test_position_does_not_advance_during_a_pause(head: Playhead, until: int, paused_for: int, offset: int) -> None:
    paused_ns = head.anchor_ns + until
    paused = head.toggled(paused_ns)
    assert paused.due_ns(head.place_ns) is None
    assert paused.place_at(paused_ns + paused_for) == head.place_at(paused_ns)
    resumed = paused.toggled(paused_ns + paused_for)
    position = head.place_at(paused_ns) + offset
    assert abs((resumed.due_ns(position) - head.due_ns(position)) - paused_for) <= max(2.0, 2 / head.rate, 1e-9 * position)


@given(HEADS, NS, RATE)
def test_rate_change_continues_from_the_same_position(head: Playhead, until: int, rate: float) -> None:
    now_ns = head.anchor_ns + until
    changed = head.at_rate(rate, now_ns)
    assert changed.place_at(now_ns) == head.place_at(now_ns)
    assert changed.rate == rate


@given(HEADS, NS, NS, st.booleans())
def test_seek_changes_the_position_and_keeps_rate_and_pause(head, position, until, paused):
    now_ns = head.anchor_ns + until
    before = head.toggled(now_ns) if paused else head
    moved = before.moved(position, now_ns)
    assert moved.place_at(now_ns) == position
    assert (moved.rate, moved.paused) == (head.rate, paused)


@given(NS, NS, NS, NS)
def test_all_positions_are_due_at_rate_zero(position: int, anchor: int, other: int, later: int) -> None:
    head = Playhead(position, anchor, 0.0)
    assert head.due_ns(other) == anchor
    assert head.place_at(anchor + later) == position
    assert head.toggled(later).due_ns(other) is None


def test_faster_and_slower_step_through_the_rates() -> None:
    assert [faster(rate) for rate in RATES[:-1]] == list(RATES[1:])
    assert [slower(rate) for rate in RATES[1:]] == list(RATES[:-1])
    assert (faster(RATES[-1]), slower(RATES[0])) == (RATES[-1], RATES[0])
    assert (faster(1.5), slower(1.5)) == (2.0, 1.0)
    assert (faster(0.0), slower(0.0)) == (0.0, RATES[-1])
