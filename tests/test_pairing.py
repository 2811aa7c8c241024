"""Pairing by capture time: every way in which two viewers can disagree."""

from hypothesis import given, settings
from hypothesis import strategies as st

from common.pairing import GONE_AFTER, LONG_NS, OUTDATED, Instant, Pairs, offer

FRAME_NS = 66_000_000
VIEWERS = ("1", "2")
Event = tuple[str, int]


def play(events: list[Event]) -> tuple[Pairs[Event], list[Instant[Event]]]:
    """Offer (viewer, captured_ns), which are also the values."""
    pairs: Pairs[Event] = Pairs(VIEWERS, FRAME_NS // 2)
    given_out: list[Instant[Event]] = []
    for viewer, captured_ns in events:
        pairs, instants = offer(pairs, viewer, captured_ns, (viewer, captured_ns))
        given_out += instants
    return pairs, given_out


def both(k: int, jitter_ns: int = 0) -> list[Event]:
    return [("1", k * FRAME_NS), ("2", k * FRAME_NS + jitter_ns)]


def shape(instants: list[Instant[Event]]) -> list[tuple[str, ...]]:
    return [tuple(sorted(instant.items)) for instant in instants]


def test_on_time_every_frame_is_paired() -> None:
    pairs, instants = play([e for k in range(1, 6) for e in both(k, 3_000_000)])
    assert shape(instants) == [("1", "2")] * 5
    assert [i.captured_ns for i in instants] == [k * FRAME_NS for k in range(1, 6)]
    assert dict(pairs.counts) == {}


def test_an_instant_waits_for_the_other_viewer() -> None:
    assert play([("1", FRAME_NS)])[1] == []
    assert shape(play([("2", FRAME_NS), ("1", FRAME_NS + 1)])[1]) == [("1", "2")]


def test_frames_half_a_period_apart_are_paired_and_further_ones_are_not() -> None:
    half = FRAME_NS // 2
    assert shape(play([("1", FRAME_NS), ("2", FRAME_NS + half)])[1]) == [("1", "2")]
    apart = play([("1", FRAME_NS), ("2", FRAME_NS + half + 1)])[1]
    assert ("1", "2") not in shape(apart)


def test_a_missing_frame_is_waited_for_until_the_next_one() -> None:
    pairs, instants = play([*both(1), ("1", 2 * FRAME_NS), *both(3)])
    assert shape(instants) == [("1", "2"), ("1",), ("1", "2")]
    assert pairs.counts == {"unpaired": 1}


def test_a_late_frame_is_counted_and_dropped() -> None:
    pairs, instants = play([*both(1), ("1", 2 * FRAME_NS), *both(3), ("2", 2 * FRAME_NS)])
    assert shape(instants) == [("1", "2"), ("1",), ("1", "2")]
    assert pairs.counts["late"] == 1


def test_a_doubled_frame_is_counted_and_dropped_before_and_after_its_instant() -> None:
    pairs, instants = play([("1", FRAME_NS), ("1", FRAME_NS), ("2", FRAME_NS)])
    assert shape(instants) == [("1", "2")]
    assert pairs.counts == {"doubled": 1}
    pairs, instants = play([*both(1), ("1", FRAME_NS), *both(2), *both(3)])
    assert shape(instants) == [("1", "2")] * 3
    assert sum(pairs.counts.values()) == 1


def test_frames_out_of_order_are_sorted_and_counted() -> None:
    pairs, instants = play([("1", 3 * FRAME_NS), ("1", 2 * FRAME_NS), *both(2), *both(3)])
    assert [instant.captured_ns for instant in instants] == [2 * FRAME_NS, 3 * FRAME_NS]
    assert pairs.counts["out_of_order"] == 1


def test_an_unknown_viewer_is_counted_and_dropped() -> None:
    pairs, instants = play([("9", FRAME_NS), *both(1)])
    assert shape(instants) == [("1", "2")]
    assert pairs.counts == {"unknown": 1}


def test_a_viewer_that_is_gone_is_not_waited_for_and_may_come_back() -> None:
    alone = [("1", k * FRAME_NS) for k in range(2, GONE_AFTER + 6)]
    pairs, instants = play([*both(1), *alone])
    assert shape(instants)[1:] == [("1",)] * len(alone), "no more waiting once it is gone"
    assert pairs.missed["2"] == len(alone)
    back = GONE_AFTER + 6
    for first in (both(back), both(back)[::-1]):
        _, instants = play([*both(1), *alone, *first, *both(back + 1)])
        assert shape(instants)[-1] == ("1", "2")


EVENTS = st.lists(
    st.tuples(st.sampled_from([*VIEWERS, "9"]), st.integers(1, 12), st.integers(-40_000_000, 40_000_000)).map(
        lambda e: (e[0], e[1] * FRAME_NS + e[2])
    ),
    max_size=40,
)


@given(EVENTS)
@settings(max_examples=300)
def test_whatever_comes_pairs_are_near_and_nothing_is_given_out_twice_or_back_in_time(events: list[Event]) -> None:
    pairs, instants = play(events)
    out = [value for instant in instants for value in instant.items.values()]
    assert len(out) == len(set(out)), "twice"
    assert set(out) <= set(events)
    for instant in instants:
        assert instant.items
        assert set(instant.items) <= set(VIEWERS)
        assert all(viewer == value[0] for viewer, value in instant.items.items())
        assert all(0 <= value[1] - instant.captured_ns <= FRAME_NS // 2 for value in instant.items.values())
    waiting = sum(len(queue) for queue in pairs.waiting.values())
    dropped = sum(pairs.counts.get(what, 0) for what in ("unknown", "doubled", "late"))
    assert len(out) + waiting + dropped <= len(events)


@given(EVENTS)
@settings(max_examples=300)
def test_instants_come_in_the_order_of_time(events: list[Event]) -> None:
    times = [instant.captured_ns for instant in play(events)[1]]
    assert times == sorted(set(times))


@given(st.lists(st.integers(-8_000_000, 8_000_000), min_size=1, max_size=20), st.randoms(use_true_random=False))
def test_regular_viewers_are_always_paired_whoever_is_first(jitters: list[int], random) -> None:  # type: ignore[no-untyped-def]
    events = []
    for k, jitter in enumerate(jitters, start=1):
        pair = both(k, jitter)
        random.shuffle(pair)
        events += pair
    pairs, instants = play(events)
    assert shape(instants) == [("1", "2")] * len(jitters)
    assert not pairs.counts


MANY = ("a", "b", "c", "d", "e")


def play_many(events: list[Event]) -> tuple[Pairs[Event], list[Instant[Event]]]:
    pairs: Pairs[Event] = Pairs(MANY, FRAME_NS // 2)
    given_out: list[Instant[Event]] = []
    for viewer, captured_ns in events:
        pairs, instants = offer(pairs, viewer, captured_ns, (viewer, captured_ns))
        given_out += instants
    return pairs, given_out


@given(st.lists(st.sets(st.sampled_from(MANY), min_size=1), min_size=1, max_size=20), st.randoms(use_true_random=False))
def test_of_many_viewers_those_that_saw_an_instant_are_in_it(saw: list[set[str]], random) -> None:  # type: ignore[no-untyped-def]
    """Whoever comes, goes and comes back: what is offered is given out, waits for a frame at most, or was late."""
    events = []
    for k, viewers in enumerate(saw, start=1):
        order = sorted(viewers)
        random.shuffle(order)
        events += [(viewer, k * FRAME_NS) for viewer in order]
    pairs, instants = play_many(events)
    for instant in instants:
        assert set(instant.items) <= saw[instant.captured_ns // FRAME_NS - 1]
    out = sum(len(instant.items) for instant in instants)
    waiting = [item.captured_ns for queue in pairs.waiting.values() for item in queue]
    assert out + len(waiting) + pairs.counts.get("late", 0) == len(events)
    assert len(set(waiting)) <= len(MANY)
    assert all(captured_ns > instant.captured_ns for captured_ns in waiting for instant in instants)


def test_of_many_viewers_one_that_leaves_delays_the_rest_for_few_frames_and_joins_again() -> None:
    whole = [(viewer, k * FRAME_NS) for k in (1, 2) for viewer in MANY]
    without = [(viewer, k * FRAME_NS) for k in range(3, 20) for viewer in MANY[:-1]]
    again = [(viewer, k * FRAME_NS) for k in range(20, 23) for viewer in MANY]
    _, instants = play_many([*whole, *without, *again])
    assert [len(instant.items) for instant in instants[:2]] == [5, 5]
    assert [instant.captured_ns // FRAME_NS for instant in instants] == list(range(1, 23))
    assert {len(instant.items) for instant in instants[2:19]} == {4}
    assert [len(instant.items) for instant in instants[-2:]] == [5, 5]
    _, before = play_many([*whole, *without])
    assert before[-1].captured_ns == 19 * FRAME_NS, "once it is gone nobody waits"


def test_one_time_far_ahead_does_not_silence_the_viewers_for_good() -> None:
    """A clock that was set wrong for a moment, or somebody who lies."""
    before = [event for k in range(1, 6) for event in both(k)]
    ahead = [("1", 2**62 + k * FRAME_NS) for k in range(3)]
    after = [event for k in range(6, 6 + OUTDATED) for event in both(k)]
    pairs, instants = play([*before, *ahead, *after])
    assert pairs.counts["began_anew"] == 1
    assert shape(instants)[-5:] == [("1", "2")] * 5
    assert instants[-1].captured_ns == (5 + OUTDATED) * FRAME_NS


def test_a_viewer_alone_that_is_far_behind_does_not_take_the_others_back() -> None:
    now = 100 * LONG_NS
    events = [event for k in range(3 * OUTDATED) for event in (("1", now + k * FRAME_NS), ("2", k * FRAME_NS))]
    pairs, instants = play(events)
    assert "began_anew" not in pairs.counts
    assert [i.captured_ns for i in instants] == sorted(i.captured_ns for i in instants)


def test_what_waits_of_a_viewer_whose_clock_was_wrong_does_not_wait_for_ever() -> None:
    """The other viewer goes on meanwhile, so it is not time itself that begins anew."""
    after = [event for k in range(1, 2 * OUTDATED) for event in both(k)]
    pairs, instants = play([*both(0), ("1", 10**18), *after])
    assert pairs.counts["began_anew"] == 1
    assert shape(instants)[-10:] == [("1", "2")] * 10
    assert max(instant.captured_ns for instant in instants) < 10**18
