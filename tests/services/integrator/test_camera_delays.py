"""Camera delays of a running rig: found, confirmed, corrected in steps, kept."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise

import pytest
from msgspec import structs

from tests.support.moving_balls import SIZE, mask_of, ring
from tests.support.two_view_run import envelope
from zenocap.common.bus.protocol import Tick
from zenocap.common.messages import CameraDelays, FrameRate, Message, Silhouette
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.vision.mask_codec import pack
from zenocap.services.integrator import camera_delays, timekeeper
from zenocap.services.integrator.camera_delays import DelaySetup
from zenocap.services.integrator.parameters import DELAY_RECOVERY_TICKS, DELAY_STEP
from zenocap.services.integrator.rate_ladder import Ladder
from zenocap.services.integrator.rate_reports import RateSetup, RateState
from zenocap.services.integrator.shell import warn_of_others
from zenocap.services.integrator.timekeeper import TimekeeperSetup, TimekeeperState

FPS, START_NS = 20.0, 10**18
FRAME_MS = 1e3 / FPS
CAMERAS = ring((0, 90))
MASKS: dict[tuple[str, int], tuple[tuple[int, int, int, int], bytes]] = {}


def setup(*, follow: bool = True) -> TimekeeperSetup:
    return TimekeeperSetup(RateSetup(tuple(CAMERAS), FPS, True), DelaySetup(CAMERAS, round(1e9 / FPS), follow))


def silhouette(name: str, frame: int, shown_s: float, *, still: bool = False) -> Silhouette:
    key = name, -1 if still else round(shown_s * 1000)
    if key not in MASKS:
        MASKS[key] = pack(mask_of(CAMERAS[name], shown_s, still=still))
    region, data = MASKS[key]
    captured_ns = START_NS + round(frame * 1e9 / FPS)
    return Silhouette(frame=frame, captured_ns=captured_ns, viewer=name, size=SIZE, region=region, data=data)


def play(
    late_s: Callable[[float], Mapping[str, float]], seconds: int, *, follow: bool = True, still: bool = False
) -> tuple[TimekeeperState, list[CameraDelays]]:
    """late_s: by camera, at a time.  The state at the end, and what was published of the delays."""
    one, state, published = setup(follow=follow), TimekeeperState(), list[Message]()
    for frame in range(round(seconds * FPS)):
        time_s = frame / FPS
        for name in CAMERAS:
            seen = silhouette(name, frame, 5.0 + time_s - late_s(time_s).get(name, 0.0), still=still)
            state, messages = timekeeper.step(one, state, envelope(seen))
            published += messages
        if frame % FPS == FPS - 1:
            state, messages = timekeeper.step(one, state, Tick(START_NS + round(frame * 1e9 / FPS)))
            published += messages
    return state, [its for its in published if isinstance(its, CameraDelays)]


@pytest.mark.nightly
def test_a_late_camera_is_corrected_in_steps_after_two_estimates() -> None:
    state, found = play(lambda _: {"cam02": 0.1}, 55)
    first, second, *_ = found
    for one in (first, second):
        assert one.found_ms == pytest.approx({"cam01": 0.0, "cam02": 100.0}, abs=8.0)
    assert (first.applied_ms, first.uncertain, second.uncertain) == ({}, [], [])
    applied = [its.applied_ms.get("cam02", 0.0) for its in found]
    assert all(0 <= later - one <= DELAY_STEP * FRAME_MS + 1e-9 for one, later in pairwise(applied))
    assert applied[-1] == pytest.approx(100.0, abs=8.0)
    assert camera_delays.skew_ms(found[-1]) < 8.0
    assert timekeeper.counts(state)["camera_skew_us"] < 8_000
    text = timekeeper.describe(setup(), state)
    assert all(words in text for words in ("viewer cam02", "late, corrected by"))
    assert "cam01" not in text


@pytest.mark.nightly
def test_report_corrects_nothing_and_equal_events_give_equal_messages() -> None:
    state, found = play(lambda _: {"cam01": 0.15}, 46, follow=False)
    assert len(found) == 2
    assert all(its.applied_ms == {} for its in found)
    assert timekeeper.counts(state)["camera_skew_us"] == pytest.approx(150_000, abs=8_000)
    assert "corrected" not in timekeeper.describe(setup(follow=False), state)
    assert play(lambda _: {"cam01": 0.15}, 46, follow=False)[1] == found


@pytest.mark.parametrize("follow", [False, True])
def test_under_overload_only_delays_that_are_corrected_are_estimated(follow: bool) -> None:
    state = TimekeeperState(RateState(rate=Ladder(level=2)))
    state = replace(state, delays=replace(state.delays, now_ns=START_NS))
    state, _ = timekeeper.step(setup(follow=follow), state, envelope(silhouette("cam01", 0, 5.0)))
    assert bool(state.delays.outlines) == follow
    full = replace(state, rate=RateState())
    full, _ = timekeeper.step(setup(follow=follow), full, envelope(silhouette("cam01", 1, 5.05)))
    assert len(full.delays.outlines["cam01"]) == 1 + follow


@pytest.mark.nightly
def test_an_estimate_that_the_next_one_contradicts_is_not_corrected() -> None:
    _, found = play(lambda time_s: {"cam02": 0.0 if time_s < 22 else 0.2}, 46)
    assert [round(max(its.found_ms.values()) / 100) for its in found] == [0, 2]
    assert all(its.applied_ms == {} for its in found)


@pytest.mark.slow
def test_a_still_person_gives_no_delay() -> None:
    _, (found, *_) = play(lambda _: {}, 25, still=True)
    assert (found.found_ms, found.uncertain, found.applied_ms) == ({}, list(CAMERAS), {})


CORRECTION = CameraDelays(
    frame=7, captured_ns=START_NS, found_ms={"cam01": 0.0, "cam02": 40.0}, errors_ms={"cam01": 0.0, "cam02": 1.0},
    uncertain=[], applied_ms={"cam01": 0.0, "cam02": 40.0},
)  # fmt: skip


def ticked() -> TimekeeperState:
    """State that does not wait for an earlier correction any more."""
    state = TimekeeperState()
    for tick in range(DELAY_RECOVERY_TICKS):
        state, _ = timekeeper.step(setup(), state, Tick(START_NS + tick * 10**9))
    return state


def test_the_correction_survives_a_restart_and_is_dropped_without_follow() -> None:
    without = structs.replace(CORRECTION, frame=8, captured_ns=START_NS + 1, applied_ms={})
    for follow, expected in ((True, CORRECTION), (False, without)):
        state, (again,) = timekeeper.step(setup(follow=follow), TimekeeperState(), envelope(CORRECTION))
        assert again == expected
        assert timekeeper.step(setup(follow=follow), state, envelope(CORRECTION))[1] == []
    waiting = TimekeeperState()
    for tick in range(4):  # a tracker under load answered after 1.5 s, and its correction was taken for a false one
        waiting, _ = timekeeper.step(setup(), waiting, Tick(START_NS + tick * 10**9))
    assert timekeeper.step(setup(), waiting, envelope(CORRECTION))[1] == [CORRECTION]
    late, messages = timekeeper.step(setup(), ticked(), envelope(CORRECTION))
    assert (late.delays, messages) == (replace(ticked().delays, contradicted=True), [])


def test_a_decision_of_another_program_is_named_once_and_contradicted(caplog: pytest.LogCaptureFixture) -> None:
    once = OncePerSource(logging.getLogger())
    rate = FrameRate(frame=1, captured_ns=START_NS, keep=1, of=1000, from_ns=START_NS, phase_ns=0, fps=FPS)
    warn_of_others(once, ticked())
    assert caplog.text == ""
    for message, sent, text in ((CORRECTION, "applied_ms", "delays of cameras: not"), (rate, "of", "frame rate: not")):
        state, _ = timekeeper.step(setup(), ticked(), envelope(message))
        warn_of_others(once, state)
        warn_of_others(once, state)
        assert caplog.text.count(text) == 1
        _, (again, *_) = timekeeper.step(setup(), state, Tick(START_NS + 10**10))
        assert (type(again), getattr(again, sent)) == (type(message), {"applied_ms": {}, "of": 1}[sent])


def test_damaged_silhouettes_are_counted() -> None:
    seen = silhouette("cam01", 0, 5.0)
    broken = structs.replace(seen, data=seen.data[: len(seen.data) // 2])
    state, messages = timekeeper.step(setup(), TimekeeperState(), envelope(broken))
    assert messages == []
    assert timekeeper.counts(state) == {"silhouette_damaged": 1}


@pytest.mark.parametrize(("count", "pairs"), [(2, 1), (3, 3), (4, 6), (7, 14)])
def test_each_camera_is_compared_with_the_next_two(count: int, pairs: int) -> None:
    found = DelaySetup(ring([360 * k / count for k in range(count)]), 1, False).pairs
    assert len(set(found)) == len(found) == pairs
    assert all(sum(name in pair for pair in found) == min(4, count - 1) for name in {one for pair in found for one in pair})


@pytest.mark.parametrize("named", ["found_ms", "errors_ms", "applied_ms"])
def test_a_decision_that_names_a_camera_of_another_rig_is_not_continued(named: str) -> None:
    state, messages = timekeeper.step(
        setup(), TimekeeperState(), envelope(structs.replace(CORRECTION, **{named: {"hall": 1.0}}))
    )
    assert (state, messages) == (TimekeeperState(), [])


def test_a_correction_that_none_can_have_found_is_not_continued() -> None:
    """100 s, received before the first own one, held for ever: the tracker waited for 3,000 silhouettes of each viewer."""
    false = structs.replace(CORRECTION, applied_ms={"cam01": 0.0, "cam02": 1e5})
    assert timekeeper.step(setup(), TimekeeperState(), envelope(false)) == (TimekeeperState(), [])


def test_a_correction_of_another_program_is_answered_with_the_own_one() -> None:
    foreign = structs.replace(CORRECTION, found_ms={}, errors_ms={}, applied_ms={"cam01": 500.0})
    one, state = setup(), ticked()
    state, _ = timekeeper.step(one, state, envelope(foreign))
    state, messages = timekeeper.step(one, state, Tick(START_NS + DELAY_RECOVERY_TICKS * 10**9))
    (answer,) = [its for its in messages if isinstance(its, CameraDelays)]
    assert answer.applied_ms == {}
    state, messages = timekeeper.step(one, state, envelope(answer))
    _, messages = timekeeper.step(one, state, Tick(START_NS + (DELAY_RECOVERY_TICKS + 1) * 10**9))
    assert not [its for its in messages if isinstance(its, CameraDelays)]


def test_silhouettes_of_a_clock_that_is_far_off_begin_no_window() -> None:
    one = setup()
    state, _ = timekeeper.step(one, TimekeeperState(), Tick(START_NS))
    ahead = structs.replace(silhouette("cam01", 0, 5.0), captured_ns=START_NS + 3600 * 10**9)
    state, _ = timekeeper.step(one, state, envelope(ahead))
    assert state.delays.begin_ns is None
    state, _ = timekeeper.step(one, state, envelope(silhouette("cam01", 1, 5.05)))
    assert state.delays.begin_ns == START_NS + round(1e9 / FPS)
