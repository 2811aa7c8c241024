"""Service loop: every event reaches the step, failures do not end a take, and health reports them."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from threading import Semaphore
from time import monotonic
from typing import TypeVar
from unittest.mock import Mock

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from tests.common.bus.test_inbox import bap, sighting
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.runtime import service as service_module
from zenocap.common.runtime.clock import ManualClock, RealClock
from zenocap.common.runtime.clock_offset import Offset
from zenocap.common.runtime.frame_rate import FrameChoice, Share
from zenocap.common.runtime.service import Event, Runner, Service, Stepper, TooManyFailures, TopicSubscription, run
from zenocap.common.runtime.signals import stop_signals
from zenocap.common.topics import CAMERA, FRAME_RATE, HANDLED, HEALTH, SIGHTING, UNIVERSAL_BAP

M = TypeVar("M", bound=m.Message)


@dataclass(frozen=True)
class Image:
    frame: int
    captured_ns: int


@dataclass(frozen=True)
class RecordedEvents:
    """A state that keeps its events."""

    frames: tuple[int, ...] = ()
    baps: tuple[int, ...] = ()
    alive: tuple[str, ...] = ()
    ticks: int = 0


@dataclass(frozen=True)
class Setup:
    fails_on: frozenset[int] = field(default_factory=frozenset)


def step(setup: Setup, state: RecordedEvents, event: Event[Image]) -> tuple[RecordedEvents, Sequence[m.Message]]:
    match event:
        case Envelope(message=m.UniversalBap() as message):
            return replace(state, baps=(*state.baps, message.frame)), []
        case Alive():
            return replace(state, alive=(*state.alive, event.id)), []
        case Tick():
            return replace(state, ticks=state.ticks + 1), []
        case Image():
            if event.frame in setup.fails_on:
                raise RuntimeError("no person")
            return replace(state, frames=(*state.frames, event.frame)), [sighting("1", event.frame)]
        case _:
            return state, []


def viewer(**changes: object) -> Service[Setup, RecordedEvents, Image]:
    service: Service[Setup, RecordedEvents, Image] = Service(
        "viewer", "1", Setup(), RecordedEvents, step, (TopicSubscription(UNIVERSAL_BAP),), watch_alive=True
    )
    return replace(service, **changes)


def runner_of(**changes: object) -> Runner[Setup, RecordedEvents, Image]:
    return Runner(viewer(**changes), LocalNetwork("studio", ManualClock(1)).bus(), ManualClock(1))


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", RealClock())


def messages_on(bus: LocalBus, kind: type[M]) -> list[M]:
    received = [event.message for event in iter(bus.receive, None) if isinstance(event, Envelope)]
    return [message for message in received if isinstance(message, kind)]


def until_reported(
    network: LocalNetwork, reports: list[m.Health], done: Callable[[m.Health], bool], answer: Callable[[Image], None]
) -> Iterator[Image]:
    """Frames, each followed by `answer`, until `done` is true for one of the reports."""
    reader = network.bus()
    reader.subscribe(HEALTH, service="viewer", id="1")
    for image in paced(network, 100_000):
        yield image
        answer(image)
        reports += messages_on(reader, m.Health)
        if any(map(done, reports)):
            return


def paced(network: LocalNetwork, frames: int) -> Iterator[Image]:
    """Frames, each after the sighting of the previous one, so that none is replaced."""
    watcher = network.bus()
    watcher.subscribe(SIGHTING, every=True)
    for frame in range(frames):
        yield Image(frame, 1000 + frame)
        while watcher.receive() is None:
            pass


def test_each_kind_of_event_reaches_the_step() -> None:
    runner = runner_of()
    runner.subscribe()
    for event in (Image(4, 1), Envelope("key", UNIVERSAL_BAP, bap(7), 1), Alive("viewer", "2", True, 1), Tick(5)):
        runner.handle(event)
    assert runner.state == RecordedEvents(frames=(4,), baps=(7,), alive=("2",), ticks=1)


def test_a_failing_step_keeps_the_state_and_is_counted(caplog: pytest.LogCaptureFixture) -> None:
    runner = runner_of(setup=Setup(frozenset({1, 2})))
    for event in (*(Image(frame, 1) for frame in range(4)), Tick(2)):
        runner.handle(event)
    assert runner.state.frames == (0, 3)
    assert {"frames": 2, "failed_frames": 2, "step_errors": 2}.items() <= runner.meter.counts.items()
    assert [line.split(" (")[0] for line in caplog.messages] == ["frame: step failed on frame 1: RuntimeError: no person"]
    assert "Traceback" in caplog.text


def test_an_interruption_that_a_library_has_made_an_error_of_is_one() -> None:
    """As numba does while it loads a kernel; for a runner, and for `zenocap verify`, which has steps alone."""

    def unpickling(*_: object) -> tuple[RecordedEvents, Sequence[m.Message]]:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemError("returned a result with an exception set") from error

    for step_of in (runner_of(step=unpickling).handle, Stepper(viewer(step=unpickling)).step):
        with pytest.raises(KeyboardInterrupt):
            step_of(Image(1, 1))


def test_a_step_that_keeps_failing_ends_the_service_and_one_successful_step_resets_the_count() -> None:
    runner = runner_of(setup=Setup(frozenset(range(100)) - {9, 19}))
    for frame in range(29):
        runner.handle(Image(frame, 1))
    assert runner.state.frames == (9, 19)
    with pytest.raises(TooManyFailures, match="10 steps in a row failed, the last on frame 29: no person"):
        runner.handle(Image(29, 1))


def test_a_service_that_ends_without_memory_says_so() -> None:
    """Its reason was empty."""
    runner = runner_of(step=Mock(side_effect=MemoryError), max_failures=1)
    with pytest.raises(TooManyFailures, match="1 steps in a row failed, the last on frame 1: MemoryError"):
        runner.handle(Image(1, 1))


def test_failures_on_received_messages_do_not_end_a_service() -> None:
    def refuse(_: Setup, state: RecordedEvents, event: Event[Image]) -> tuple[RecordedEvents, Sequence[m.Message]]:
        if isinstance(event, Envelope):
            raise ValueError("invalid body")
        return replace(state, ticks=state.ticks + 1), []

    runner = runner_of(step=refuse)
    for frame in range(100):
        runner.handle(Envelope("key", UNIVERSAL_BAP, bap(frame), 1))
    runner.handle(Tick(5))
    assert runner.state.ticks == 1
    assert runner.meter.counts["step_errors"] == 100


def test_a_message_out_of_range_is_counted_and_not_sent(caplog: pytest.LogCaptureFixture) -> None:
    network = LocalNetwork("studio", ManualClock(1))
    reader = network.bus()
    reader.subscribe(SIGHTING)
    runner = Runner(viewer(), network.bus(), ManualClock(1))
    runner.publish(sighting("1", -5))
    assert runner.meter.counts["unsendable"] == 1
    assert messages_on(reader, m.Sighting) == []
    assert "Sighting" in caplog.text


def test_offline_two_runs_publish_equal_bytes() -> None:
    def run_once() -> list[bytes]:
        clock = ManualClock(0)
        network = LocalNetwork("studio", clock)
        log = network.bus()
        log.subscribe(SIGHTING, every=True)
        runner = Runner(viewer(), network.bus(), clock)
        for frame in range(5):
            clock.set(frame * 1000)
            runner.handle(Image(frame, clock.now_ns()))
        return [envelope.data for envelope in iter(log.receive, None)]

    assert run_once() == run_once()
    assert len(run_once()) == 5


def test_a_service_exits_with_0_when_its_source_ends(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(SIGHTING, every=True)
    reader.subscribe(HEALTH)
    assert run(viewer(), network.bus(), RealClock(), paced(network, 5)) == 0
    assert [event.frame for event in messages_on(reader, m.Sighting)] == [0, 1, 2, 3, 4]


def test_a_service_publishes_its_health(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(HEALTH, every=True, service="viewer", id="1")
    segmenting = viewer(describe=lambda state: "segmenting", phase=lambda state: m.Phase.SEGMENTING)
    run(segmenting, network.bus(), RealClock(), paced(network, 3), extra_counts=lambda: {"log_lost": 4})
    health = messages_on(reader, m.Health)[0]
    assert (health.service, health.id, health.state, health.frame) == ("viewer", "1", "segmenting", 0)
    assert health.phase is m.Phase.SEGMENTING
    assert health.counts["log_lost"] == 4
    assert health.memory_bytes > 1 << 20


def test_the_last_health_has_the_number_of_all_messages_before_it(network: LocalNetwork) -> None:
    reader, bus = network.bus(), network.bus()
    reader.subscribe(HEALTH, every=True)
    learning = viewer(
        phase=lambda state: m.Phase.SEGMENTING if 1 in state.frames else m.Phase.LEARNING_BACKGROUND,
        setup=Setup(frozenset({3})),
    )
    run(learning, bus, RealClock(), paced(network, 3))
    first, last = (one.counts for one in messages_on(reader, m.Health))
    assert "ended" not in first
    assert last["ended"] == 1
    assert last["process"] == first["process"]
    sent = {name: count for name, count in last.items() if name.startswith("sent.")}
    assert sent == {"sent.sighting": 3, "sent.health": 1, "sent.handled": sent["sent.handled"]}
    assert (last["frames"], last["learning_frames"], last.get("failed_frames", 0)) == (3, 2, 0)


STEPS = st.lists(st.tuples(st.integers(0, 3), st.integers(0, 2), st.integers(1, 4), st.booleans()), max_size=12)


@settings(max_examples=60)
@given(STEPS, st.integers(1, 14))
def test_every_frame_of_a_source_is_processed_failed_dropped_or_left_out(
    plan: list[tuple[int, int, int, bool]], stop_after: int
) -> None:
    """plan, by step: frames that the source leaves out, that are late, and that it gives meanwhile; whether the step fails.

    `captured_frames` is counted at the source, the others by the loop.
    """
    go, gave, steps, begun = Semaphore(0), Semaphore(0), iter(plan), 0
    network, choice = LocalNetwork("studio", RealClock()), FrameChoice(15.0)
    reader = network.bus()
    reader.subscribe(HEALTH, every=True)

    def source() -> Iterator[Image]:
        yield Image(0, 0)
        for skipped, late, frames, _ in plan:
            go.acquire(timeout=60.0)
            choice.skipped += skipped
            choice.late += late
            for _ in range(frames):
                yield Image(0, 0)
            gave.release()

    def slow(setup: Setup, state: RecordedEvents, event: Event[Image]) -> tuple[RecordedEvents, Sequence[m.Message]]:
        nonlocal begun
        if isinstance(event, Image):
            begun += 1
            one = next(steps, None)
            if one is not None:
                go.release()
                gave.acquire(timeout=60.0)
                if one[3]:
                    raise RuntimeError("no person")
        return step(setup, state, event)

    def stopped() -> bool:
        if begun >= stop_after:
            go.release(1 + len(plan))  # the source is not waited for
        return begun >= stop_after

    failing = viewer(step=slow, max_failures=1 + len(plan))
    assert run(failing, network.bus(), OneSecondClock(), source(), stopped, choice=choice) == 0
    reports = [health.counts for health in messages_on(reader, m.Health)]
    terms = ("frames", "failed_frames", "dropped_frames", "skipped_frames")
    assert [one["captured_frames"] for one in reports] == [sum(one.get(name, 0) for name in terms) for one in reports]
    if stop_after > len(plan):
        assert reports[-1]["captured_frames"] == 1 + sum(sum(one[:3]) for one in plan)


@pytest.mark.slow
def test_a_viewer_whose_frames_are_answered_too_late_reports_them_as_overrun(network: LocalNetwork) -> None:
    answering, reports = network.bus(), []

    def answer(image: Image) -> None:
        answering.publish(UNIVERSAL_BAP, bap(max(0, image.frame - 2)))  # frame - 1 has been processed

    answers = viewer(answers=lambda message: message.frame if isinstance(message, m.UniversalBap) else None)
    frames = until_reported(network, reports, lambda health: health.counts["overrun_frames"] >= 3, answer)
    assert run(answers, network.bus(), FastClock(), frames, choice=FrameChoice(15.0)) == 0
    assert reports[-1].counts["late_answers"] >= reports[-1].counts["overrun_frames"]


def test_a_viewer_follows_the_frame_rate_of_the_integrator_and_reports_it(network: LocalNetwork) -> None:
    choice, reports = FrameChoice(15.0), []
    rate = m.FrameRate(frame=0, captured_ns=1, keep=1, of=3, from_ns=1, phase_ns=0, fps=15.0)
    network.bus().publish(FRAME_RATE, rate)
    follower = viewer(subscriptions=(TopicSubscription(FRAME_RATE),))
    frames = until_reported(network, reports, lambda health: health.counts["kept_percent"] == 33, lambda _: None)
    assert run(follower, network.bus(), FastClock(), frames, choice=choice) == 0
    assert choice.share == Share(1, 3)
    assert reports[-1].state.endswith("; reduced to 5 of 15 frames/s")


def test_a_service_exits_with_1_when_its_source_fails(network: LocalNetwork, caplog: pytest.LogCaptureFixture) -> None:
    def broken() -> Iterator[Image]:
        yield Image(0, 0)
        raise OSError("camera unplugged")

    assert run(viewer(), network.bus(), RealClock(), broken()) == 1
    assert "the frame source failed: OSError: camera unplugged" in caplog.text


def test_a_second_service_of_the_same_name_exits_with_1(network: LocalNetwork, caplog: pytest.LogCaptureFixture) -> None:
    network.bus().declare_alive("viewer", "1")
    assert run(viewer(), network.bus(), RealClock(), iter([])) == 1
    assert "viewer 1 of rig studio is already running" in caplog.text


def test_a_service_that_keeps_failing_exits_with_1(network: LocalNetwork) -> None:
    failing = Mock(side_effect=RuntimeError("always"))
    assert run(viewer(step=failing, tick_ns=1), network.bus(), RealClock()) == 1


def test_a_stopped_service_exits_with_0(network: LocalNetwork) -> None:
    assert run(viewer(), network.bus(), RealClock(), stopped=lambda: True) == 0


class FastClock(RealClock):
    """A clock that runs ten times as fast."""

    def elapsed_ns(self) -> int:
        return 10 * super().elapsed_ns()


@pytest.mark.slow
def test_counts_of_the_state_are_published_without_adding_them_up(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(HEALTH, every=True)
    ends = monotonic() + 0.5
    run(viewer(count=lambda state: {"late": 3}), network.bus(), FastClock(), stopped=lambda: monotonic() > ends)
    found = [message.counts["late"] for message in messages_on(reader, m.Health)]
    assert len(found) >= 3
    assert set(found) == {3}


def test_the_clock_offset_is_passed_on_as_it_is_published(network: LocalNetwork) -> None:
    """The integrator's clock is the same here: the offset is within its error."""
    network.bus().serve_clock()
    offsets: list[Offset | None] = []

    def known() -> bool:
        return any(offsets) or monotonic() > ends

    ends = monotonic() + 60
    assert run(viewer(), network.bus(), FastClock(), stopped=known, on_clock_offset=offsets.append) == 0
    offset = offsets[-1]
    assert abs(offset.offset_ns) <= offset.error_ns


@dataclass(frozen=True)
class DeferredWork:
    """A state that delays its work until all messages have arrived."""

    waiting: tuple[int, ...] = ()
    done: tuple[tuple[int, ...], ...] = ()


def deferring_step(_: Setup, state: DeferredWork, event: Event[Image]) -> tuple[DeferredWork, Sequence[m.Message]]:
    match event:
        case Envelope(message=m.UniversalBap() as message):
            return replace(state, waiting=(*state.waiting, message.frame)), []
        case Tick():
            return DeferredWork((), (*state.done, state.waiting)), [sighting("1", max(state.waiting))]
        case _:
            return state, []


def test_deferred_work_starts_when_all_messages_are_received(network: LocalNetwork) -> None:
    service: Service[Setup, DeferredWork, Image] = Service(
        "tracker", "main", Setup(), DeferredWork, deferring_step, (TopicSubscription(UNIVERSAL_BAP, every=True),),
        pending=lambda state: bool(state.waiting), result=m.Sighting, describe=lambda state: f"{state.done}",
    )  # fmt: skip
    bus, others = network.bus(), network.bus()
    others.subscribe(HEALTH)
    rounds = 0

    def stopped() -> bool:
        nonlocal rounds
        rounds += 1
        if rounds in (2, 4):
            for frame in (10 * rounds, 10 * rounds + 1):
                others.publish(UNIVERSAL_BAP, bap(frame))
        return rounds > 8

    assert run(service, bus, OneSecondClock(), stopped=stopped) == 0
    last = messages_on(others, m.Health)[-1]
    assert last.state == "((20, 21), (40, 41))"
    assert "result_age" in last.stages_ms


@pytest.mark.parametrize("derives", [True, False])
def test_work_under_way_at_a_stop_is_given_up_as_if_the_stop_had_come_before(network: LocalNetwork, derives: bool) -> None:
    """The tracker measured the body first: half a second, and six beside ten other programs."""
    reached = list[str]()

    def long_step(setup: Setup, state: DeferredWork, event: Event[Image]) -> tuple[DeferredWork, Sequence[m.Message]]:
        if isinstance(event, Tick):
            os.kill(os.getpid(), signal.SIGTERM)
            end_s = monotonic() + 5.0
            while monotonic() < end_s:
                pass
            reached.append("the end of the step")
        return deferring_step(setup, state, event)

    service: Service[Setup, DeferredWork, Image] = Service(
        "tracker", "main", Setup(), DeferredWork, long_step, (TopicSubscription(UNIVERSAL_BAP, every=True),),
        pending=lambda state: bool(state.waiting), describe=lambda state: f"{state.done}", derives=derives,
    )  # fmt: skip
    bus, others = network.bus(), network.bus()
    for topic in (HEALTH, SIGHTING, HANDLED):
        others.subscribe(topic, every=True)

    def publish_first(state: DeferredWork) -> None:
        if not state.waiting:
            others.publish(UNIVERSAL_BAP, bap(7))

    with stop_signals() as stopped:
        assert run(service, bus, RealClock(), stopped=stopped, on_state=publish_first) == 0
    received = [event.message for event in iter(others.receive, None) if isinstance(event, Envelope)]
    assert not reached
    assert not [one for one in received if isinstance(one, m.Sighting)]
    (last,) = [one for one in received if isinstance(one, m.Health) and one.counts.get(m.ENDED)]
    assert last.state == "()"
    assert "step_errors" not in last.counts
    handled = [one.keys[key] for one in received if isinstance(one, m.Handled) for key, _ in one.events]
    assert len(handled) == derives  # the message, without the Tick


class OneSecondClock(ManualClock):
    """A clock that advances by a second per reading, so that every round publishes health."""

    def __init__(self) -> None:
        super().__init__(10**15)

    def elapsed_ns(self) -> int:
        self.set(self.now_ns() + 10**9)
        return self.now_ns()


def test_a_first_message_that_another_program_replaces_is_published_again() -> None:
    """Pages, takes and the tracker used the camera of another program until the end."""
    clock = ManualClock(1)
    network = LocalNetwork("studio", clock)
    stranger, reader = network.bus(), network.bus()
    reader.subscribe(CAMERA, every=True)
    own = built(m.CameraInfo)
    false, after = structs.replace(own, name="false"), list[list[str]]()

    def stopped() -> bool:
        after.append([message.name for message in messages_on(reader, m.CameraInfo)])
        match len(after):
            case 2 | 3 | 4:
                stranger.publish(CAMERA, false)
            case 5:
                clock.advance(1_000_000_000)  # to the next health
        return len(after) == 8

    assert run(viewer(), network.bus(), clock, stopped=stopped, first_messages=(own,)) == 0
    assert after[0] == [own.name]
    assert [name for turn in after[1:] for name in turn] == ["false", own.name, "false", "false", own.name]
    assert after[-1] == []


def test_a_loop_comes_round_with_each_health_and_not_after_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = Mock()
    monkeypatch.setattr(service_module, "come_round", calls)
    clock = ManualClock(1)
    turns = iter(range(10))

    def stopped() -> bool:
        clock.advance(500_000_000)
        return next(turns) == 6

    assert run(viewer(), LocalNetwork("studio", clock).bus(), clock, stopped=stopped) == 0
    *before, last = [call.kwargs for call in calls.call_args_list]
    assert len(before) > 3
    assert all(one == {} for one in before)
    assert last == {"loops": False}
