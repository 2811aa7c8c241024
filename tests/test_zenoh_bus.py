"""Real processes on a real Zenoh mesh: state for late joiners, deaths, duplicates, damage, clean exits."""

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import zenoh

from common import messages as m
from common.bus.protocol import Alive, DuplicateService, Envelope, Received, RoundTrip
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions, open_session
from common.runtime.clock import RealClock
from common.take.reading import Take
from common.topics import ASSIGNMENT, HEALTH, PARTIAL_BDP, SIGHTING, UNIVERSAL_BAP
from tests.rig_process import RIG, bdp
from tests.test_inbox import bap, sighting

pytestmark = pytest.mark.system

REPOSITORY = Path(__file__).parent.parent
Start = Callable[..., subprocess.Popen[str]]


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def start(endpoint: str) -> Iterator[Start]:
    """Start a role of tests.rig_process; whatever still runs at the end is killed."""
    processes: list[subprocess.Popen[str]] = []

    def starter(role: str, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "tests.rig_process", role, endpoint, *arguments]
        processes.append(subprocess.Popen(command, cwd=REPOSITORY, stderr=subprocess.PIPE, text=True))
        return processes[-1]

    yield starter
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def routed(endpoint: str) -> Iterator[ZenohOptions]:
    """Options of a client of a router in this process."""
    with open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)):
        yield client(endpoint)


def client(endpoint: str, mode: str = "client") -> ZenohOptions:
    assert mode in ("client", "peer")
    return ZenohOptions("peer" if mode == "peer" else "client", connect=(endpoint,), multicast_scouting=False)


def wait_for(bus: ZenohBus, wanted: Callable[[Received], bool], timeout_s: float = 10.0) -> Received:
    """The next event that is wanted; fails after `timeout_s`."""
    end_s = time.monotonic() + timeout_s
    while time.monotonic() < end_s:
        event = bus.receive(0.1)
        if event is not None and wanted(event):
            return event
    pytest.fail(f"nothing came within {timeout_s} s")


def carries(kind: type[m.Message], least_frame: int = 0) -> Callable[[Received], bool]:
    def wanted(event: Received) -> bool:
        return isinstance(event, Envelope) and isinstance(event.message, kind) and event.message.frame >= least_frame

    return wanted


def terminated(process: subprocess.Popen[str]) -> tuple[int, float, str]:
    """Exit status, seconds and log of a process after SIGTERM."""
    started_s = time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, log = process.communicate(timeout=10.0)
    return process.returncode, time.monotonic() - started_s, log


def test_processes_answer_each_other_and_survive_damage_and_deaths(
    start: Start, routed: ZenohOptions, tmp_path: Path
) -> None:
    path = tmp_path / "take.mcap"
    with ZenohBus.open(routed, RIG, RealClock()) as bus:
        bus.watch_alive()
        bus.subscribe(ASSIGNMENT)
        bus.subscribe(HEALTH, service="viewer")
        viewer, integrator = start("viewer", "1", "60"), start("integrator", str(path))
        wait_for(bus, carries(m.Assignment, 30))

        # Clocks of one machine are equal within the error of the round trip.
        known = wait_for(bus, lambda event: carries(m.Health)(event) and event.message.clock_error_ns > 0)
        assert isinstance(known, Envelope)
        assert isinstance(known.message, m.Health)
        assert abs(known.message.clock_offset_ns) <= known.message.clock_error_ns < 100_000_000

        # A late joiner gets the last state, which was sent long ago.
        with ZenohBus.open(routed, RIG, RealClock()) as late:
            late.subscribe(PARTIAL_BDP)
            kept = wait_for(late, carries(m.PartialBdp), 2.0)
            assert isinstance(kept, Envelope)
            assert kept.message == bdp("1")

        # Bytes of a stranger stop nobody.
        with open_session(routed) as stranger:
            for data in (b"", b"\x91" * 100, b"\xdf\xff\xff\xff\xff", bytes(1 << 20)):
                stranger.put(SIGHTING.at(RIG, viewer="1"), data)
                stranger.put(PARTIAL_BDP.at(RIG, viewer="1"), data)
        bus.subscribe(HEALTH, service="integrator")
        wounded = wait_for(bus, lambda event: _count(event, "integrator", "rejected_invalid") >= 1)
        assert _count(wounded, "integrator", "step_errors") == 0
        assert _count(wounded, "integrator", "log_messages") > 30
        assert _count(wounded, "integrator", "log_lost") == 0
        again = wait_for(bus, carries(m.Assignment))
        assert isinstance(again, Envelope)
        wait_for(bus, carries(m.Assignment, again.message.frame + 30))

        # The same viewer a second time is refused, and the first one goes on.
        second = start("viewer", "1", "60")
        _, log = second.communicate(timeout=10.0)
        assert second.returncode == 1
        assert f"viewer 1 of rig {RIG} is already running" in log

        # A killed viewer is noticed at once, and its place is free again.
        viewer.kill()
        gone = wait_for(bus, lambda event: isinstance(event, Alive) and not event.alive, 1.0)
        assert gone == Alive("viewer", "1", False, gone.received_ns)
        viewer = start("viewer", "1", "60")
        wait_for(bus, lambda event: isinstance(event, Alive) and event.service == "viewer" and event.alive)
        wait_for(bus, carries(m.Assignment, 30))

        # The log of a killed integrator lacks at most the last second.
        killed_ns = time.time_ns()
        integrator.kill()
        take = Take(path)
        recorded = list(take.messages())
        assert take.cut is not None
        assert killed_ns - recorded[-1].log_ns < 1_200_000_000
        keys = {each.topic for each in recorded}
        assert {SIGHTING.at(RIG, viewer="1"), ASSIGNMENT.at(RIG), PARTIAL_BDP.at(RIG, viewer="1")} <= keys

        status, seconds, log = terminated(viewer)
        assert (status, log.count("Traceback")) == (0, 0)
        assert seconds < 2.0


def _count(event: Received, service: str, name: str) -> int:
    match event:
        case Envelope(message=m.Health() as health) if health.service == service:
            return health.counts.get(name, 0)
        case _:
            return 0


def test_all_roles_end_within_two_seconds_of_sigterm(start: Start, endpoint: str, tmp_path: Path) -> None:
    router = start("router")
    with ZenohBus.open(client(endpoint), RIG, RealClock()) as bus:
        bus.subscribe(ASSIGNMENT)
        viewer, integrator = start("viewer", "1", "30"), start("integrator", str(tmp_path / "take.mcap"))
        wait_for(bus, carries(m.Assignment))
    ends = [terminated(process) for process in (viewer, integrator, router)]
    assert [status for status, _, _ in ends] == [0, 0, 0]
    assert max(seconds for _, seconds, _ in ends) < 2.0
    take = Take(tmp_path / "take.mcap")
    assert list(take.messages())
    assert take.cut is None


def test_a_service_without_its_router_ends_too(start: Start) -> None:
    viewer = start("viewer", "1", "30")
    with pytest.raises(subprocess.TimeoutExpired):
        viewer.communicate(timeout=1.0)
    status, seconds, log = terminated(viewer)
    assert status == 1
    assert "stopped while waiting for a Zenoh router" in log
    assert seconds < 2.0


def test_a_router_that_comes_back_finds_the_rig_again(endpoint: str) -> None:
    listening = ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)
    router = open_session(listening)
    with ZenohBus.open(client(endpoint), RIG, RealClock()) as sender:
        sender.publish(PARTIAL_BDP, bdp("1"))
        with ZenohBus.open(client(endpoint), RIG, RealClock()) as reader:
            reader.subscribe(PARTIAL_BDP)
            wait_for(reader, carries(m.PartialBdp))
            router.close()
            changed = m.PartialBdp(frame=9, captured_ns=0, viewer="1", side="side", height_px=1.0, score=0.1, lengths={})
            sender.publish(PARTIAL_BDP, changed)
            with open_session(listening):
                found = wait_for(reader, carries(m.PartialBdp), 5.0)
    assert isinstance(found, Envelope)
    assert found.message == changed


def test_a_publisher_that_comes_back_replaces_its_state(routed: ZenohOptions) -> None:
    with ZenohBus.open(routed, RIG, RealClock()) as reader:
        reader.subscribe(PARTIAL_BDP)
        for frame in (5, 3, 1):
            message = m.PartialBdp(
                frame=frame, captured_ns=0, viewer="1", side="side", height_px=1.0, score=0.1, lengths={}
            )
            with ZenohBus.open(routed, RIG, RealClock()) as sender:
                sender.publish(PARTIAL_BDP, message)
                found = wait_for(reader, carries(m.PartialBdp), 2.0)
            assert isinstance(found, Envelope)
            assert found.message == message


def test_of_two_that_could_not_see_each_other_the_older_goes_on(endpoint: str) -> None:
    with (
        ZenohBus.open(client(endpoint, "peer"), RIG, RealClock()) as older,
        ZenohBus.open(client(endpoint, "peer"), RIG, RealClock()) as newer,
    ):
        older.declare_alive("viewer", "1")
        newer.declare_alive("viewer", "1")
        assert newer.receive(0.0) is None
        with open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)):
            with pytest.raises(DuplicateService, match=f"viewer 1 of rig {RIG} is already running"):
                wait_for(newer, lambda _: False, 5.0)
            assert older.receive(0.0) is None


def test_latest_all_and_every_over_the_network(routed: ZenohOptions) -> None:
    with (
        ZenohBus.open(routed, RIG, RealClock()) as sender,
        ZenohBus.open(routed, RIG, RealClock()) as reader,
        reader.reader() as log,
    ):
        reader.subscribe(SIGHTING, viewer="1")
        reader.subscribe(UNIVERSAL_BAP)
        log.subscribe(SIGHTING, every=True)
        log.subscribe(UNIVERSAL_BAP, every=True)
        for name in ("1", "2"):
            _until_heard(sender, reader if name == "1" else log, name)
        _all(reader)
        before = reader.counters.dropped.get("superseded", 0)
        for frame in range(100, 120):
            sender.publish(SIGHTING, sighting("1", frame))
            sender.publish(UNIVERSAL_BAP, bap(frame))
        everything = [wait_for(log, lambda event: _frame(event) >= 100) for _ in range(40)]
        assert sorted(_frame(event) for event in everything) == sorted([*range(100, 120)] * 2)
        # The reader has its own connection: its newest sighting is there when the 19 before it were superseded.
        end_s = time.monotonic() + 10
        while reader.counters.dropped.get("superseded", 0) < before + 19 and time.monotonic() < end_s:
            time.sleep(0.01)
        heard: list[Received] = []
        while sum(map(carries(m.UniversalBap), heard)) < 20:
            heard.append(wait_for(reader, lambda event: _frame(event) >= 100))
        heard += _all(reader)
        assert [_frame(event) for event in heard if carries(m.UniversalBap)(event)] == list(range(100, 120))
        assert [_frame(event) for event in heard if carries(m.Sighting)(event)] == [119]
        assert reader.counters.rejected == {}


def _frame(event: Received) -> int:
    return event.message.frame if isinstance(event, Envelope) else -1


def _all(bus: ZenohBus) -> list[Received]:
    return list(iter(lambda: bus.receive(0.0), None))


def _until_heard(sender: ZenohBus, reader: ZenohBus, viewer: str) -> None:
    """Publish until a first message comes: subscriptions take a moment to reach the sender."""
    for frame in range(100):
        sender.publish(SIGHTING, sighting(viewer, frame))
        if reader.receive(0.1) is not None:
            return
    pytest.fail("the reader hears nothing")


def test_only_one_answers_the_clock(routed: ZenohOptions) -> None:
    with ZenohBus.open(routed, RIG, RealClock()) as keeper, ZenohBus.open(routed, RIG, RealClock()) as asking:
        keeper.serve_clock()
        trips = []
        for _ in range(100):
            asking.ask_clock()
            trip = asking.receive(0.1)
            if isinstance(trip, RoundTrip):
                trips.append(trip)
            if len(trips) == 3:
                break
        assert len(trips) == 3
        assert all(trip.sent_ns <= trip.answered_ns <= trip.received_ns for trip in trips)


def test_a_stranger_cannot_disturb_the_clock(routed: ZenohOptions) -> None:
    with ZenohBus.open(routed, RIG, RealClock()) as keeper, open_session(routed) as stranger:
        keeper.serve_clock()
        for _ in range(50):
            list(stranger.get(f"zenocap/{RIG}/integrator/clock", payload=b"\x91" * 9, timeout=0.2))
            if keeper.counters.rejected:
                break
        assert set(keeper.counters.rejected) == {"invalid"}
        assert isinstance(stranger, zenoh.Session)


def test_who_listens_finds_every_rig_and_hears_them_apart(routed: ZenohOptions) -> None:
    clock = RealClock()
    with ZenohBus.open(routed, "watching", clock) as watching:
        for rig in ("studio", "lab"):
            with ZenohBus.open(routed, rig, clock) as bus:
                bus.declare_alive("viewer", "1")
                assert watching.rigs() == {rig}
                with watching.beside(rig) as beside:
                    beside.subscribe(UNIVERSAL_BAP)
                    beside.watch_alive()
                    wait_for(beside, lambda event: isinstance(event, Alive) and event.alive)
                    bus.publish(UNIVERSAL_BAP, bap(7))
                    event = wait_for(beside, lambda event: isinstance(event, Envelope))
                    assert isinstance(event, Envelope)
                    assert event.key == f"zenocap/{rig}/integrator/bap"
        assert watching.rigs() == set()
        with pytest.raises(ValueError, match="rig"):
            watching.beside("*")
