"""The loop: every event reaches the step, failures do not end a take, and health says what happened."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from time import monotonic

import pytest

from common import messages as m
from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Alive, Envelope, Tick
from common.runtime.clock import ManualClock, RealClock
from common.runtime.service import Event, GivingUp, Runner, Service, Subscription, run
from common.topics import HEALTH, SIGHTING, UNIVERSAL_BAP
from tests.test_inbox import bap, sighting


@dataclass(frozen=True)
class Image:
    frame: int
    captured_ns: int


@dataclass(frozen=True)
class Seen:
    """A state that remembers its events."""

    frames: tuple[int, ...] = ()
    baps: tuple[int, ...] = ()
    alive: tuple[str, ...] = ()
    ticks: int = 0


@dataclass(frozen=True)
class Setup:
    fails_on: frozenset[int] = field(default_factory=frozenset)


def step(setup: Setup, state: Seen, event: Event[Image]) -> tuple[Seen, Sequence[m.Message]]:
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


def viewer(**changes: object) -> Service[Setup, Seen, Image]:
    service: Service[Setup, Seen, Image] = Service(
        "viewer", "1", Setup(), Seen(), step, (Subscription(UNIVERSAL_BAP),), watch_alive=True
    )
    return replace(service, **changes)


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", RealClock())


def messages_on(bus: LocalBus, kind: type[m.Message]) -> list[m.Message]:
    found = []
    while (event := bus.receive()) is not None:
        if isinstance(event, Envelope) and isinstance(event.message, kind):
            found.append(event.message)
    return found


def paced(network: LocalNetwork, frames: int, ready: Callable[[], bool] = lambda: True) -> Iterator[Image]:
    """Frames, each when the one before it was sighted, so that none is replaced."""
    watcher = network.bus()
    watcher.subscribe(SIGHTING, every=True)
    for frame in range(frames):
        yield Image(frame, 1000 + frame)
        while watcher.receive() is None:
            pass


def test_each_kind_of_event_reaches_the_step() -> None:
    network = LocalNetwork("studio", ManualClock(1))
    runner = Runner(viewer(), network.bus(), ManualClock(1))
    runner.subscribe()
    for event in (Image(4, 1), Envelope("key", UNIVERSAL_BAP, bap(7), 1), Alive("viewer", "2", True, 1), Tick(5)):
        runner.handle(event)
    assert runner.state == Seen(frames=(4,), baps=(7,), alive=("2",), ticks=1)


def test_a_failing_step_keeps_the_state_and_is_counted(caplog: pytest.LogCaptureFixture) -> None:
    network = LocalNetwork("studio", ManualClock(1))
    runner = Runner(viewer(setup=Setup(frozenset({1, 2}))), network.bus(), ManualClock(1))
    for frame in range(4):
        runner.handle(Image(frame, 1))
    assert runner.state.frames == (0, 3)
    assert runner.meter.counts["step_errors"] == 2
    assert [record.getMessage().split(" (")[0] for record in caplog.records] == [
        "frame: step failed on frame 1: RuntimeError: no person"
    ]
    assert "Traceback" in caplog.text


def test_a_step_that_keeps_failing_ends_the_service() -> None:
    network = LocalNetwork("studio", ManualClock(1))
    runner = Runner(viewer(setup=Setup(frozenset(range(100)))), network.bus(), ManualClock(1))
    for frame in range(9):
        runner.handle(Image(frame, 1))
    with pytest.raises(GivingUp, match="10 steps in a row failed, the last on frame 9: no person"):
        runner.handle(Image(9, 1))


def test_what_others_send_ends_no_service() -> None:
    def refuse(setup: None, state: int, event: Event[Image]) -> tuple[int, list[m.Message]]:
        if isinstance(event, Envelope):
            raise ValueError("what a body")
        return state + 1, []

    network = LocalNetwork("studio", ManualClock(1))
    service: Service[None, int, Image] = Service("viewer", "1", None, 0, refuse)
    runner = Runner(service, network.bus(), ManualClock(1))
    for frame in range(100):
        runner.handle(Envelope("key", UNIVERSAL_BAP, bap(frame), 1))
    runner.handle(Tick(5))
    assert runner.state == 1
    assert runner.meter.counts["step_errors"] == 100


def test_one_good_step_forgives_the_failures() -> None:
    network = LocalNetwork("studio", ManualClock(1))
    failing = frozenset(range(100)) - {9, 19}
    runner = Runner(viewer(setup=Setup(failing)), network.bus(), ManualClock(1))
    for frame in range(28):
        runner.handle(Image(frame, 1))
    assert runner.state.frames == (9, 19)


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
    def once() -> list[bytes]:
        clock = ManualClock(0)
        network = LocalNetwork("studio", clock)
        log = network.bus()
        log.subscribe(SIGHTING, every=True)
        runner = Runner(viewer(), network.bus(), clock)
        for frame in range(5):
            clock.set(frame * 1000)
            runner.handle(Image(frame, clock.now_ns()))
        found = []
        while isinstance(envelope := log.receive(), Envelope):
            found.append(envelope.data)
        return found

    assert once() == once()
    assert len(once()) == 5


def test_a_service_ends_with_its_source(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(SIGHTING, every=True)
    reader.subscribe(HEALTH)
    assert run(viewer(), network.bus(), RealClock(), paced(network, 5)) == 0
    assert [event.frame for event in messages_on(reader, m.Sighting)] == [0, 1, 2, 3, 4]


def test_a_service_says_its_health(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(HEALTH, service="viewer", id="1")
    looking = viewer(describe=lambda state: "looking")
    run(looking, network.bus(), RealClock(), paced(network, 3), extra_counts=lambda: {"log_lost": 4})
    health = messages_on(reader, m.Health)[0]
    assert isinstance(health, m.Health)
    assert (health.service, health.id, health.state, health.frame) == ("viewer", "1", "looking", 0)
    assert health.counts["log_lost"] == 4
    assert health.memory_bytes > 1 << 20


def test_a_source_that_breaks_ends_the_service_with_an_error(
    network: LocalNetwork, caplog: pytest.LogCaptureFixture
) -> None:
    def broken() -> Iterator[Image]:
        yield Image(0, 0)
        raise OSError("camera unplugged")

    assert run(viewer(), network.bus(), RealClock(), broken()) == 1
    assert "the frame source failed: OSError: camera unplugged" in caplog.text


def test_a_second_service_of_a_name_does_not_run(network: LocalNetwork, caplog: pytest.LogCaptureFixture) -> None:
    network.bus().declare_alive("viewer", "1")
    assert run(viewer(), network.bus(), RealClock(), iter([])) == 1
    assert "viewer 1 of rig studio is already running" in caplog.text


def test_a_service_that_keeps_failing_exits_with_1(network: LocalNetwork) -> None:
    def ticking(setup: Setup, state: Seen, event: Event[Image]) -> tuple[Seen, Sequence[m.Message]]:
        raise RuntimeError("always")

    assert run(viewer(step=ticking, tick_ns=1), network.bus(), RealClock()) == 1


def test_a_stopped_service_exits_with_0(network: LocalNetwork) -> None:
    assert run(viewer(), network.bus(), RealClock(), stopped=lambda: True) == 0


class TenTimes(RealClock):
    """A clock on which a second passes in a tenth of one."""

    def elapsed_ns(self) -> int:
        return 10 * super().elapsed_ns()


def test_what_a_state_has_counted_is_said_as_it_is_and_not_added_up(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(HEALTH, every=True)
    ends = monotonic() + 0.5
    counting = viewer(count=lambda state: {"late": 3})
    run(counting, network.bus(), TenTimes(), stopped=lambda: monotonic() > ends)
    found = [message.counts["late"] for message in messages_on(reader, m.Health) if isinstance(message, m.Health)]
    assert len(found) >= 3
    assert set(found) == {3}


@dataclass(frozen=True)
class Working:
    """A state that puts off its work until everything has come."""

    waiting: tuple[int, ...] = ()
    done: tuple[tuple[int, ...], ...] = ()


def putting_off(_: Setup, state: Working, event: Event[Image]) -> tuple[Working, Sequence[m.Message]]:
    match event:
        case Envelope(message=m.UniversalBap() as message):
            return replace(state, waiting=(*state.waiting, message.frame)), []
        case Tick():
            return Working((), (*state.done, state.waiting)), [sighting("1", max(state.waiting))]
        case _:
            return state, []


def test_work_that_was_put_off_is_started_once_everything_has_come(network: LocalNetwork) -> None:
    service: Service[Setup, Working, Image] = Service(
        "tracker", "main", Setup(), Working(), putting_off, (Subscription(UNIVERSAL_BAP, every=True),),
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

    assert run(service, bus, OneSecond(), stopped=stopped) == 0
    healths = messages_on(others, m.Health)
    last = healths[-1]
    assert isinstance(last, m.Health)
    assert last.state == "((20, 21), (40, 41))"
    assert "result_age" in last.stages_ms


class OneSecond(ManualClock):
    """Every look at it is a second later, so that there is a health report in each round."""

    def __init__(self) -> None:
        super().__init__(10**15)

    def elapsed_ns(self) -> int:
        self.set(self.now_ns() + 10**9)
        return self.now_ns()
