"""Frames that viewers process at a reduced rate: all viewers choose the same instants."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from zenocap.common.messages import FrameRate, Health
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.runtime.frame_rate import (
    FrameChoice,
    Share,
    ViewerCounts,
    common_phase,
    counts_in,
    describe,
    farthest_phase,
    phase_of,
    share_of,
)
from zenocap.services.integrator.parameters import RATE_LEVELS

S = 1_000_000_000
PERIOD = S // 30
Limit = Literal["", "viewers", "tracker"]
START_NS = 1_700_000_000 * S
SHARES = st.sampled_from([Share(*pair) for pair in RATE_LEVELS[1:11]])


def decision(
    keep: int, of: int, from_ns: int = 0, captured_ns: int | None = None, phase_ns: int = 0, limit: Limit = "",
    viewers: Sequence[str] = (),
) -> FrameRate:  # fmt: skip
    return FrameRate(
        frame=0, captured_ns=from_ns if captured_ns is None else captured_ns, keep=keep, of=of, from_ns=from_ns,
        phase_ns=phase_ns, fps=30.0, limit=limit, viewers=list(viewers),
    )  # fmt: skip


def reduced(keep: int, of: int, fps: float = 30.0, phase_ns: int = 0) -> FrameChoice:
    choice = FrameChoice(fps)
    choice.set_rate(decision(keep, of, phase_ns=phase_ns))
    return choice


def kept(choice: FrameChoice, times_ns: list[int]) -> list[int]:
    return [k for k, time_ns in enumerate(times_ns) if choice.wants(time_ns)]


def test_without_a_decision_every_frame_is_processed() -> None:
    choice = FrameChoice(30.0)
    assert kept(choice, [k * PERIOD for k in range(50)]) == list(range(50))
    assert choice.describe() == ""
    assert {"overrun_frames": 0, "skipped_frames": 0, "kept_percent": 100}.items() <= choice.counts().items()


@given(SHARES, st.integers(0, 10**6))
def test_of_every_n_slots_as_many_are_kept_as_the_share_says_evenly_spread(share: Share, first: int) -> None:
    slots = [slot for slot in range(first, first + 10 * share.of) if share.keeps(slot)]
    assert len(slots) == 10 * share.keep
    gaps = {after - before for before, after in pairwise(slots)}
    assert min(gaps) >= share.spacing
    assert max(gaps) <= share.spacing + 1


def jitters(most: float, count: int) -> st.SearchStrategy[list[float]]:
    return st.lists(st.floats(-most, most), min_size=count, max_size=count)


@pytest.mark.slow
@given(SHARES, st.lists(st.integers(-2 * S, 2 * S), min_size=2, max_size=5), jitters(0.4, 40))
def test_synchronized_viewers_with_any_clocks_and_jitter_choose_the_same_instants(share, offsets_ns, jitter):
    """Jitter of less than half a period, of which each viewer has another."""
    chosen = []
    for number, offset_ns in enumerate(offsets_ns):
        choice = reduced(share.keep, share.of)
        choice.set_clock_offset(Offset(offset_ns, 1))
        own = jitter[number:] + jitter[:number]
        instants = [round((k + own[k] + 10**6) * S / 30) for k in range(40)]
        frames = kept(choice, [instant + 10 * S + offset_ns for instant in instants])
        chosen.append([k for k in frames if k >= share.of])  # the first frame of a source is always processed
    assert all(frames == chosen[0] for frames in chosen)
    assert chosen[0] or share.of >= 39


@pytest.mark.slow
@given(SHARES, st.lists(st.floats(0.0, 0.7), min_size=2, max_size=4), st.floats(0.0, 1.0), jitters(0.1, 120))
def test_unsynchronized_viewers_choose_the_frames_nearest_to_the_same_instants(share, phases, common, jitter):
    """Free-running cameras, all phases of which are within 0.7 periods somewhere in the frame period."""
    phase_ns = common_phase([phase_of(round((phase + common) * S / 30), 30.0) for phase in phases], 30.0)
    slots = []
    for phase in phases:
        choice = reduced(share.keep, share.of, phase_ns=phase_ns)
        times_ns = [round((10**6 + k + phase + common + jitter[k]) * S / 30) for k in range(120)]
        own = [round((times_ns[k] - phase_ns) * 30 / S) for k in kept(choice, times_ns)]
        assert all(share.keeps(slot) for slot in own[1:])  # the first frame of a source is always processed
        slots.append({slot for slot in own[1:] if 10**6 + share.of + 2 < slot < 10**6 + 115})
    assert all(chosen == slots[0] for chosen in slots)


@given(st.lists(st.integers(0, S // 30), min_size=1, max_size=8))
def test_the_common_phase_is_as_far_as_possible_from_half_a_period_off(phases: list[int]) -> None:
    best = farthest_phase(phases, common_phase(phases, 30.0), 30.0)
    assert best <= min(farthest_phase(phases, k * PERIOD // 50, 30.0) for k in range(50)) + 0.021
    assert common_phase([], 30.0) == 0


def test_a_viewer_reports_the_phase_of_its_frames_on_the_integrators_clock() -> None:
    choice = FrameChoice(30.0)
    choice.set_clock_offset(Offset(5_000_000, 1))
    choice.wants(START_NS + 5_000_000 + 7_000_000)
    assert choice.counts()["phase_us"] == pytest.approx(7000, abs=2)  # 30 periods are a second


def test_a_decision_holds_from_its_capture_time_in_all_viewers() -> None:
    """The viewers receive it at different times before."""
    changes = []
    for received in (10, 29):
        choice, frames = FrameChoice(30.0), []
        for k in range(60):
            if k == received:
                choice.set_rate(decision(1, 3, from_ns=30 * PERIOD, captured_ns=10 * PERIOD))
            if choice.wants(k * PERIOD + PERIOD // 10):
                frames.append(k)
        changes.append(frames)
    assert changes[0] == changes[1] == [*range(30), *range(30, 60, 3)]


def test_older_impossible_and_far_decisions_are_not_followed() -> None:
    choice = reduced(1, 2)
    choice.set_rate(decision(1, 3, from_ns=8 * S, captured_ns=8 * S))
    choice.set_rate(decision(1, 1, from_ns=7 * S, captured_ns=7 * S))
    assert choice.share == Share(1, 3)
    assert share_of(decision(3, 2)) == Share()
    choice.set_rate(decision(1, 5, from_ns=2**62, captured_ns=9 * S))  # in a hundred years
    assert len(kept(choice, [9 * S + k * PERIOD for k in range(50)])) == pytest.approx(10, abs=1)
    choice.set_rate(
        decision(1, 1000, from_ns=9 * S, captured_ns=9 * S + 1)
    )  # an actor would wait for the frame of 33 s later
    assert choice.share == Share(1, 5)
    for false_ns in (2**62, 18 * S, 10 * S + 1, 10 * S, 9 * S + S // 2):  # which the integrator contradicts each second
        choice = FrameChoice(30.0)
        choice.set_rate(decision(1, 6, from_ns=false_ns, captured_ns=false_ns))
        for own_ns in (9 * S, 10 * S):
            choice.set_rate(decision(1, 1, from_ns=own_ns, captured_ns=own_ns))
        assert choice.share == Share()


def test_a_clock_that_is_set_back_stops_no_viewer() -> None:
    choice = reduced(1, 4)
    assert kept(choice, [100 * S + k * PERIOD for k in range(8)])
    assert kept(choice, [k * PERIOD for k in range(8)])


def test_late_frames_of_an_endless_source_are_counted_and_skipped_ones_too() -> None:
    choice = reduced(1, 2)
    assert choice.next_index(100, 100, 0, 30.0) == 100
    assert choice.next_index(101, 101, 0, 30.0) == 102
    assert (choice.late, choice.skipped) == (0, 1)
    assert choice.next_index(103, 107, 0, 30.0) == 108  # 104 and 106 are late
    assert (choice.late, choice.skipped) == (2, 4)
    started = FrameChoice(30.0)
    assert started.next_index(0, 5000, 0, 30.0) == 5000
    assert (started.late, started.skipped) == (0, 0)  # nothing is late before the start of a viewer


def test_a_clock_set_forward_by_decades_does_not_stop_an_endless_source() -> None:
    """Each late frame was looked at, for hours."""
    years = 10**11
    for choice in (FrameChoice(30.0), reduced(1, 2)):
        first = choice.next_index(0, 0, 0, 30.0)
        index = choice.next_index(first + 1, years, 0, 30.0)
        assert index in (years, years + 1)
        assert choice.late + choice.skipped == index - first - 1


def test_frames_after_losses_are_counted_as_overrun() -> None:
    choice = FrameChoice(30.0)
    for losses in (0, 0, 3, 3, 4):
        choice.begin_frame(losses)
    assert choice.counts()["overrun_frames"] == 2


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (None, ""),
        (decision(1, 1), ""),
        (decision(1, 2, limit="viewers", viewers=["1"]), "reduced to 15 of 30 frames/s: processor of viewer 1"),
        (decision(2, 7, limit="viewers", viewers=["1", "2"]), "reduced to 8.6 of 30 frames/s: processor of 2 viewers"),
        (decision(5, 6, limit="tracker"), "reduced to 25 of 30 frames/s: processor of the tracker"),
        (decision(5, 6), "reduced to 25 of 30 frames/s"),
    ],
)
def test_the_text_has_both_rates_and_the_reason(message: FrameRate | None, text: str) -> None:
    assert describe(message) == text


def test_a_viewer_reports_its_rate() -> None:
    choice = reduced(2, 3)
    assert choice.describe() == "reduced to 20 of 30 frames/s"
    assert choice.counts()["kept_percent"] == 67
    counts = {"frames": 30, "dropped_frames": 4, "overrun_frames": 2}
    assert counts_in(built(Health, counts=counts)) == ViewerCounts(30, 4, 2)
