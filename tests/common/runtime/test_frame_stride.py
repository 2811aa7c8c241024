"""The stride of an overloaded viewer: when it changes, and which frames it keeps."""

from dataclasses import replace
from itertools import pairwise

import pytest
from msgspec import structs

from zenocap.common.messages import Health
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.runtime.frame_stride import FrameStride, StrideSettings, StrideState, observe, stride_in

S = 1_000_000_000
PERIOD = S // 30
SETTINGS = StrideSettings(S // 2, 8, missed=0.3, spare=0.6, wait_ns=10 * S, longest_wait_ns=40 * S)


def after(seconds: float, state: StrideState, missed_every: int = 0, work: float = 0.1, start_ns: int = 0) -> StrideState:
    """State after processed frames.  missed_every: each n-th frame follows a lost one.  work: share of the frame period."""
    now_ns, number = start_ns, 0
    while now_ns < start_ns + seconds * S:
        period_ns = state.stride * PERIOD
        number += 1
        missed = missed_every > 0 and number % missed_every == 0
        state = observe(SETTINGS, state, now_ns, missed, round(work * period_ns), PERIOD)
        now_ns += period_ns
    return state


def health(stride: int) -> Health:
    counts = {"frame_stride": stride}
    return Health(frame=0, captured_ns=0, service="viewer", id="2", state="", rate=0.0, stages_ms={}, counts=counts)


def forced(stride: int, fps: float = 30.0, origin_ns: int = 0) -> FrameStride:
    """A stride after enough lost frames.  Its next loss counter is 1000."""
    control, now_ns, losses = FrameStride(SETTINGS, fps, origin_ns), 0, 0
    while control.stride < stride:
        now_ns, losses = now_ns + S // 30, losses + 1
        control.begin_frame(now_ns, losses, 0)
    return control


def test_a_viewer_that_keeps_up_keeps_every_frame() -> None:
    assert after(60, StrideState()).stride == 1


def test_one_stall_and_few_lost_frames_are_no_overload() -> None:
    state = after(3, StrideState())
    state = observe(SETTINGS, state, 8 * S, True, 5 * S, PERIOD)
    assert after(3, state, start_ns=8 * S).stride == 1
    assert after(60, StrideState(), missed_every=4).stride == 1


def test_the_stride_doubles_while_frames_are_lost_but_not_below_the_lowest_rate() -> None:
    assert after(0.7, StrideState(), missed_every=2).stride == 2
    assert after(60, StrideState(), missed_every=1).stride == 4  # 7.5 frames/s; 3.75 are too few


def test_the_stride_is_halved_only_with_time_to_spare_and_without_lost_frames() -> None:
    overloaded = replace(StrideState(), stride=4, wait_ns=10 * S)
    assert after(8, overloaded).stride == 4
    assert after(30, overloaded, work=0.5).stride == 4
    assert after(30, overloaded, missed_every=6).stride == 4
    assert after(15, overloaded).stride == 2
    assert after(30, overloaded).stride == 1


def test_the_wait_doubles_each_time_a_halving_was_too_early() -> None:
    state, now_ns, changes = StrideState(), 0, []
    while len(changes) < 9:
        before = state.stride
        state = observe(SETTINGS, state, now_ns, state.stride == 1, 0, PERIOD)
        now_ns += state.stride * PERIOD
        if state.stride != before:
            changes.append((now_ns / S, state.stride))
    waits = [end - start for (start, stride), (end, _) in pairwise(changes) if stride == 2]
    assert waits == pytest.approx([10, 20, 40, 40], abs=2.0)


@pytest.mark.parametrize("strides", [(2, 2), (2, 4), (1, 4)])
def test_viewers_of_different_strides_share_the_frames_of_the_larger(strides: tuple[int, int]) -> None:
    kept = []
    for stride in strides:
        control = forced(stride)
        kept.append({k for k in range(100, 200) if control.wants(k * S // 30)})
    assert {k for k in range(100, 200) if k % max(strides) == 0} <= kept[0] & kept[1]
    assert len(kept[0]) == pytest.approx(100 / strides[0], abs=2)


def test_a_viewer_follows_the_largest_stride_requested_until_that_viewer_is_gone() -> None:
    control = FrameStride(SETTINGS, 30.0, 0, ["2"])
    control.set_other(health(4), S)
    assert (control.stride, control.requested, control.describe()) == (4, 1, "overloaded: every 4th frame")
    assert control.counts()["frame_stride"] == 1  # so that none holds the others up once the overload has ended
    control.begin_frame(2 * S, 0, 0)
    assert control.stride == 4
    control.begin_frame(5 * S, 0, 0)
    assert control.stride == 1


def test_a_viewer_that_loses_frames_requests_twice_the_stride_in_use_and_one_below_it_waits() -> None:
    state = StrideState(frames=20, missed=20, since_ns=0)
    assert observe(SETTINGS, state, S, True, 0, PERIOD, used=2).stride == 4
    state = StrideState(stride=2, frames=20, spare=20, since_ns=0)
    assert observe(SETTINGS, state, S, False, 0, PERIOD, used=4).stride == 2
    assert observe(SETTINGS, state, S, False, 0, PERIOD, used=2).stride == 1


def test_viewers_whose_clocks_differ_keep_the_same_instants() -> None:
    """The second clock is 0.1 s ahead, so its frames of the same instants have larger times."""
    one, other = forced(2), forced(2)
    other.set_clock_offset(Offset(S // 10, 1))
    instants = [k * S // 30 for k in range(100, 200)]
    kept = [ns for ns in instants if one.wants(ns)][2:-2]
    assert kept == [ns for ns in instants if other.wants(ns + S // 10)][2:-2]


def test_a_slow_camera_whose_frames_miss_all_multiples_is_not_starved() -> None:
    control = forced(2)
    assert sum(control.wants(k * S // 30) for k in range(101, 301, 2)) >= 45
    assert control.skipped <= 55


def test_late_frames_of_an_endless_source_are_counted_and_skipped_ones_too() -> None:
    control = forced(2)
    assert control.next_index(100, 100, 0, 30.0) == 100
    assert control.next_index(101, 101, 0, 30.0) == 102
    assert (control.late, control.skipped) == (0, 1)
    assert control.next_index(103, 107, 0, 30.0) == 108  # 104 and 106 are late
    assert (control.late, control.skipped) == (2, 4)


def test_frames_before_the_start_of_a_viewer_are_not_counted() -> None:
    control = FrameStride(SETTINGS, 30.0, 0)
    assert control.next_index(0, 5000, 0, 30.0) == 5000
    assert control.counts() == {"frame_stride": 1, "skipped_frames": 0}
    assert control.late == 0


def test_the_health_text_names_the_stride() -> None:
    assert [forced(stride).describe() for stride in (1, 2, 4)] == [
        "", "overloaded: every 2nd frame", "overloaded: every 4th frame",
    ]  # fmt: skip


def test_a_health_without_stride_is_of_a_viewer_that_skips_none() -> None:
    assert stride_in(health(4), PERIOD) == 4
    assert stride_in(structs.replace(health(4), counts={}), PERIOD) == 1


@pytest.mark.parametrize("stride", [0, 3, 6, 8, 2**40])
def test_an_impossible_stride_is_not_followed(stride: int) -> None:
    """Neither zero, nor one between the grids, nor one with fewer than 5 frames per second."""
    assert stride_in(health(stride), PERIOD) == 1
    control = FrameStride(SETTINGS, 30.0, 0, ["2"])
    control.set_other(health(stride), S)
    assert control.stride == 1


def test_the_stride_of_a_viewer_of_no_rig_file_is_not_followed() -> None:
    control = FrameStride(SETTINGS, 30.0, 0, ["3"])
    control.set_other(health(2), S)
    assert control.stride == 1
