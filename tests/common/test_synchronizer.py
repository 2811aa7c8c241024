"""Frame sets by capture time, with jitter, losses, late frames and wrong clocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.common.synchronizer import FARTHEST, GONE_AFTER, LONG_NS, OUTDATED, FrameSet, Synchronizer, push, with_spacing

FRAME_NS = 66_000_000
VIEWERS = ("1", "2")
Event = tuple[str, int]


def play(
    events: list[Event], viewers: tuple[str, ...] = VIEWERS, hold: int = 0
) -> tuple[Synchronizer[Event], list[FrameSet[Event]]]:
    """Push (viewer, captured_ns), which are also the values."""
    pairs: Synchronizer[Event] = Synchronizer(viewers, FRAME_NS // 2, hold=hold)
    frame_sets: list[FrameSet[Event]] = []
    for viewer, captured_ns in events:
        pairs, instants = push(pairs, viewer, captured_ns, (viewer, captured_ns))
        frame_sets += instants
    return pairs, frame_sets


def both(k: int, jitter_ns: int = 0) -> list[Event]:
    return [("1", k * FRAME_NS), ("2", k * FRAME_NS + jitter_ns)]


def shape(instants: list[FrameSet[Event]]) -> list[tuple[str, ...]]:
    return [tuple(sorted(instant.items)) for instant in instants]


ONE, HALF = ("1", FRAME_NS), FRAME_NS // 2
BOTH = ("1", "2")


@pytest.mark.parametrize(
    ("events", "frame_sets", "counts"),
    [
        pytest.param([e for k in range(1, 6) for e in both(k, 3_000_000)], [BOTH] * 5, {}, id="none late"),
        pytest.param([ONE], [], {}, id="a frame set waits for the other viewer"),
        pytest.param([("2", FRAME_NS), ("1", FRAME_NS + 1)], [BOTH], {}, id="any order of viewers"),
        pytest.param([ONE, ("2", FRAME_NS + HALF)], [BOTH], {}, id="half a period apart"),
        pytest.param([ONE, ("2", int(1.6 * FRAME_NS)), ("2", int(2.6 * FRAME_NS)), ("2", int(3.6 * FRAME_NS))],
                     [BOTH, ("2",)], {"unpaired": 1}, id="a stopped viewer is not waited for to find the nearest"),
        pytest.param([*both(1), ("1", 2 * FRAME_NS), *both(3)], [BOTH, ("1",), BOTH], {"unpaired": 1},
                     id="a missing frame is waited for until the next one"),
        pytest.param([*both(1), ("1", 2 * FRAME_NS), *both(3), ("2", 2 * FRAME_NS)], [BOTH, ("1",), BOTH],
                     {"unpaired": 1, "late": 1}, id="a late frame is dropped"),
        pytest.param([ONE, ONE, ("2", FRAME_NS)], [BOTH], {"doubled": 1}, id="a duplicate is dropped"),
        pytest.param([*both(1), ONE, *both(2), *both(3)], [BOTH] * 3, {"doubled": 1}, id="a duplicate after its frame set"),
        pytest.param([("1", 3 * FRAME_NS), ("1", 2 * FRAME_NS), *both(2), *both(3)], [("1",), BOTH],
                     {"out_of_order": 1, "doubled": 2, "late": 1, "unpaired": 1}, id="frames out of order are sorted"),
        pytest.param([("9", FRAME_NS), *both(1)], [BOTH], {"unknown": 1}, id="an unknown viewer is dropped"),
    ],
)  # fmt: skip
def test_frames_are_paired_and_every_other_one_is_counted(events, frame_sets, counts):
    pairs, found = play(events)
    assert shape(found) == frame_sets
    assert dict(pairs.counts) == counts
    assert [instant.captured_ns for instant in found] == sorted({min(t for _, t in i.items.values()) for i in found})


def test_frames_more_than_half_a_period_apart_are_not_paired() -> None:
    assert BOTH not in shape(play([ONE, ("2", FRAME_NS + HALF + 1)])[1])


@pytest.mark.parametrize("hold", [1, 2, 5, 30])
def test_items_that_arrive_periods_later_are_paired_with_a_hold_also_after_an_interruption(hold: int) -> None:
    """Of viewer 2, whose delay is corrected, item k arrives after item k + hold of viewer 1."""

    events = [("1", k * FRAME_NS) for k in range(1, hold + 1)]
    for k in range(hold + 1, 200):
        events += [("1", k * FRAME_NS), *([] if 90 < k < 110 else [("2", (k - hold) * FRAME_NS)])]
    whole = [instant.captured_ns // FRAME_NS for instant in play(events, hold=hold)[1] if len(instant.items) == 2]
    assert whole[0] == 1
    assert whole[-1] == 199 - hold
    assert len(whole) >= 199 - hold - 19 - 2 * hold - 3
    assert hold == 1 or len([instant for instant in play(events)[1] if len(instant.items) == 2]) < 10


@pytest.mark.slow
@given(phase=st.floats(0.0, 1.0), seed=st.integers(0, 1000))
def test_frames_of_varying_periods_are_paired_at_any_phase(phase: float, seed: int) -> None:
    """Two cameras whose frames come up to 8 % of a period early or late: at most those at both ends are alone."""
    jitter = np.random.default_rng(seed).uniform(-0.08, 0.08, (2, 40))
    times = [("1", round((k + jitter[0, k]) * FRAME_NS)) for k in range(1, 40)]
    times += [("2", round((k + phase + jitter[1, k]) * FRAME_NS)) for k in range(1, 40)]
    _, instants = play(sorted(times, key=lambda event: event[1]))
    alone = [k for k, names in enumerate(shape(instants)) if len(names) == 1]
    assert len(alone) <= 2
    assert len(instants) >= 37


def test_a_frame_is_paired_with_the_nearest_one() -> None:
    _, instants = play([("1", FRAME_NS), ("2", int(1.6 * FRAME_NS)), ("1", 2 * FRAME_NS), ("2", int(2.6 * FRAME_NS))])
    assert [dict(instant.items) for instant in instants] == [
        {"1": ("1", FRAME_NS)},
        {"1": ("1", 2 * FRAME_NS), "2": ("2", int(1.6 * FRAME_NS))},
    ]


def test_an_absent_viewer_is_not_waited_for_and_may_return() -> None:
    alone = [("1", k * FRAME_NS) for k in range(2, GONE_AFTER + 6)]
    pairs, instants = play([*both(1), *alone])
    assert shape(instants)[1:] == [("1",)] * len(alone), "an absent viewer is not waited for"
    assert pairs.missed["2"] == len(alone)
    back = GONE_AFTER + 6
    for first in (both(back), both(back)[::-1]):
        _, instants = play([*both(1), *alone, *first, *both(back + 1)])
        assert shape(instants)[-1] == ("1", "2")


TIMES = st.builds(lambda k, jitter_ns: k * FRAME_NS + jitter_ns, st.integers(1, 12), st.integers(-40_000_000, 40_000_000))
EVENTS = st.lists(st.tuples(st.sampled_from([*VIEWERS, "9"]), TIMES), max_size=40)


@pytest.mark.nightly
@given(EVENTS)
@settings(max_examples=300)
def test_any_events_give_frame_sets_in_time_order_close_in_time_without_duplicates(events: list[Event]) -> None:
    pairs, instants = play(events)
    times = [instant.captured_ns for instant in instants]
    assert times == sorted(set(times))
    out = [value for instant in instants for value in instant.items.values()]
    assert len(out) == len(set(out)), "duplicate values"
    assert set(out) <= set(events)
    for instant in instants:
        assert instant.items
        assert set(instant.items) <= set(VIEWERS)
        assert all(viewer == value[0] for viewer, value in instant.items.items())
        assert all(0 <= value[1] - instant.captured_ns <= FARTHEST * FRAME_NS / 2 for value in instant.items.values())
    waiting = sum(len(queue) for queue in pairs.waiting.values())
    dropped = sum(pairs.counts.get(what, 0) for what in ("unknown", "doubled", "late"))
    assert len(out) + waiting + dropped <= len(events)


@given(st.lists(st.integers(-8_000_000, 8_000_000), min_size=1, max_size=20), st.randoms(use_true_random=False))
def test_regular_viewers_are_always_paired_in_any_order_of_arrival(jitters: list[int], random) -> None:  # type: ignore[no-untyped-def]
    events = []
    for k, jitter in enumerate(jitters, start=1):
        pair = both(k, jitter)
        random.shuffle(pair)
        events += pair
    pairs, instants = play(events)
    assert shape(instants) == [("1", "2")] * len(jitters)
    assert not pairs.counts


MANY = ("a", "b", "c", "d", "e")


@pytest.mark.nightly
@given(st.lists(st.sets(st.sampled_from(MANY), min_size=1), min_size=1, max_size=20), st.randoms(use_true_random=False))
def test_a_frame_set_has_the_viewers_that_captured_it(captured: list[set[str]], random) -> None:  # type: ignore[no-untyped-def]
    """Viewers join, leave and return: a frame is emitted, waits for at most one frame period, or was late."""
    events = []
    for k, viewers in enumerate(captured, start=1):
        order = sorted(viewers)
        random.shuffle(order)
        events += [(viewer, k * FRAME_NS) for viewer in order]
    pairs, instants = play(events, MANY)
    for instant in instants:
        assert set(instant.items) <= captured[instant.captured_ns // FRAME_NS - 1]
    out = sum(len(instant.items) for instant in instants)
    waiting = [item.captured_ns for queue in pairs.waiting.values() for item in queue]
    assert out + len(waiting) + pairs.counts.get("late", 0) == len(events)
    assert len(set(waiting)) <= len(MANY)
    assert all(captured_ns > instant.captured_ns for captured_ns in waiting for instant in instants)


def test_a_viewer_that_leaves_delays_the_others_for_few_frames_and_may_return() -> None:
    whole = [(viewer, k * FRAME_NS) for k in (1, 2) for viewer in MANY]
    without = [(viewer, k * FRAME_NS) for k in range(3, 20) for viewer in MANY[:-1]]
    again = [(viewer, k * FRAME_NS) for k in range(20, 23) for viewer in MANY]
    _, instants = play([*whole, *without, *again], MANY)
    assert [len(instant.items) for instant in instants[:2]] == [5, 5]
    assert [instant.captured_ns // FRAME_NS for instant in instants] == list(range(1, 23))
    assert {len(instant.items) for instant in instants[2:19]} == {4}
    assert [len(instant.items) for instant in instants[-2:]] == [5, 5]
    _, before = play([*whole, *without], MANY)
    assert before[-1].captured_ns == 19 * FRAME_NS, "an absent viewer is not waited for"


def test_a_time_stamp_far_ahead_does_not_block_the_viewers_permanently() -> None:
    """From a clock that was wrong for a short time, or from a false time stamp."""
    before = [event for k in range(1, 6) for event in both(k)]
    ahead = [("1", 2**62 + k * FRAME_NS) for k in range(3)]
    after = [event for k in range(6, 6 + OUTDATED) for event in both(k)]
    pairs, instants = play([*before, *ahead, *after])
    assert pairs.counts["began_anew"] == 1
    assert shape(instants)[-5:] == [("1", "2")] * 5
    assert instants[-1].captured_ns == (5 + OUTDATED) * FRAME_NS


def test_one_viewer_far_behind_does_not_reset_the_common_time_base() -> None:
    now = 100 * LONG_NS
    events = [event for k in range(3 * OUTDATED) for event in (("1", now + k * FRAME_NS), ("2", k * FRAME_NS))]
    pairs, instants = play(events)
    assert "began_anew" not in pairs.counts
    assert [i.captured_ns for i in instants] == sorted(i.captured_ns for i in instants)


def test_a_queued_frame_with_a_wrong_time_stamp_is_finally_dropped() -> None:
    """The other viewer continues meanwhile, so the common time base does not restart."""
    after = [event for k in range(1, 2 * OUTDATED) for event in both(k)]
    pairs, instants = play([*both(0), ("1", 10**18), *after])
    assert pairs.counts["began_anew"] == 1
    assert shape(instants)[-10:] == [("1", "2")] * 10
    assert max(instant.captured_ns for instant in instants) < 10**18


def test_viewers_that_skip_the_same_frames_are_paired_within_half_of_their_longer_period() -> None:
    captured = [
        (viewer, k * FRAME_NS + (FRAME_NS * 9 // 10 if viewer == "2" else 0)) for k in range(0, 40, 2) for viewer in "12"
    ]
    for spacing, from_ns, complete in ((2, 0, 20), (2, 20 * FRAME_NS, 10), (1, 0, 0)):
        pairs: Synchronizer[str] = with_spacing(Synchronizer(("1", "2"), FRAME_NS // 2), spacing, from_ns)
        found = 0
        for viewer, captured_ns in captured:
            pairs, frame_sets = push(pairs, viewer, captured_ns, viewer)
            found += sum(len(frame_set.items) == 2 for frame_set in frame_sets)
        assert found == complete


def test_frame_sets_without_a_viewer_are_incomplete_while_it_is_waited_for() -> None:
    alone = [("1", k * FRAME_NS) for k in range(3, GONE_AFTER + 13)]
    pairs, _ = play([*both(0), *both(1), *both(2), *alone])
    assert (pairs.complete, pairs.incomplete) == (3 + 10, GONE_AFTER)
