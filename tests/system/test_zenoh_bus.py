"""Processes on a Zenoh mesh: late joiners, deaths, duplicates, damage, clean exits."""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import msgpack
import pytest
import zenoh

from tests.common.bus.test_inbox import bap, sighting
from tests.support.hostile import HUGE_BYTES, plain
from tests.support.live_cameras import until
from tests.support.networks import awaited, carries, client, free_endpoint, router, wait_for
from tests.support.places import ROOT
from tests.support.processes import PATIENCE_S
from tests.support.rig_process import RIG, bdp
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, DuplicateService, Envelope, Received, RoundTrip
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.recording.reader import TakeReader
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import ALIVE, ASSIGNMENT, CLAIM, CLOCK, HEALTH, PARTIAL_BDP, SIGHTING, UNIVERSAL_BAP

pytestmark = pytest.mark.core

Start = Callable[..., subprocess.Popen[str]]
Open = Callable[[], ZenohBus]
END_S = 8.0  # of a process; a session that is not closed holds it for longer, or for ever (s)
LOSS_NS = 5_000_000_000  # at most, of a log that is written every second


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def start(endpoint: str) -> Iterator[Start]:
    """Start a role of tests.support.rig_process; processes still running at the end are killed."""
    processes: list[subprocess.Popen[str]] = []

    def starter(role: str, *arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "tests.support.rig_process", role, endpoint, *arguments]
        processes.append(subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True))
        return processes[-1]

    yield starter
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def routed(endpoint: str) -> Iterator[ZenohOptions]:
    """Options of a client of a router in this process."""
    with router(endpoint) as options:
        yield options


@pytest.fixture
def opened(routed: ZenohOptions, stack: ExitStack) -> Open:
    """Open a bus around the router."""
    return lambda: stack.enter_context(ZenohBus.open(routed, RIG, RealClock()))


def terminated(process: subprocess.Popen[str]) -> tuple[int, float, str]:
    """Exit status, seconds and log of a process after SIGTERM."""
    started_s = time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, log = process.communicate(timeout=PATIENCE_S)
    return process.returncode, time.monotonic() - started_s, log


def test_processes_communicate_and_survive_invalid_messages_and_kills(
    start: Start, opened: Open, routed: ZenohOptions, tmp_path: Path
) -> None:
    path = tmp_path / "take.mcap"
    with ZenohBus.open(routed, RIG, RealClock()) as bus:
        bus.watch_alive()
        bus.subscribe(ASSIGNMENT)
        bus.subscribe(HEALTH, service="viewer")
        viewer, integrator = start("viewer", "1", "60"), start("integrator", str(path))
        awaited(bus, m.Assignment, 30)

        # Clocks of one machine are equal within the error of the round trip.
        health = wait_for(bus, lambda event: carries(m.Health)(event) and event.message.clock_error_ns > 0).message
        assert abs(health.clock_offset_ns) <= health.clock_error_ns

        # A late joiner gets the last state, which was sent long ago.
        late = opened()
        late.subscribe(PARTIAL_BDP)
        assert awaited(late, m.PartialBdp) == bdp("1")

        # Invalid bytes of an unknown sender stop no service.
        bus.subscribe(HEALTH, service="integrator")
        with open_session(routed) as foreign_session:

            def rejected(event: Received) -> bool:
                if carries(m.Health)(event):
                    for data in (b"", b"\x91" * 100, b"\xdf\xff\xff\xff\xff", bytes(1 << 20)):
                        foreign_session.put(SIGHTING.at(RIG, viewer="1"), data)
                        foreign_session.put(PARTIAL_BDP.at(RIG, viewer="1"), data)
                return _count(event, "integrator", "rejected_invalid") >= 1

            after_damage = wait_for(bus, rejected)
        assert _count(after_damage, "integrator", "step_errors") == 0
        assert _count(after_damage, "integrator", "log_messages") > 30
        assert _count(after_damage, "integrator", "log_lost") == 0
        awaited(bus, m.Assignment, awaited(bus, m.Assignment).frame + 30)

        # The same viewer a second time is rejected, and the first one continues.
        second = start("viewer", "1", "60")
        _, log = second.communicate(timeout=PATIENCE_S)
        assert second.returncode == 1
        assert f"viewer 1 of rig {RIG} is already running" in log

        # A killed viewer is detected, and its id is free again.
        viewer.kill()
        departure = wait_for(bus, lambda event: isinstance(event, Alive) and not event.alive)
        assert departure == Alive("viewer", "1", False, departure.received_ns)
        viewer = start("viewer", "1", "60")
        wait_for(bus, lambda event: isinstance(event, Alive) and event.service == "viewer" and event.alive)
        awaited(bus, m.Assignment, 30)

        # The log of a killed integrator lacks at most what came after its last write.
        killed_ns = time.time_ns()
        integrator.kill()
        take = TakeReader(path)
        recorded = list(take.messages())
        assert take.cut is not None
        assert killed_ns - recorded[-1].log_ns < LOSS_NS
        keys = {each.topic for each in recorded}
        assert {SIGHTING.at(RIG, viewer="1"), ASSIGNMENT.at(RIG), PARTIAL_BDP.at(RIG, viewer="1")} <= keys

        status, seconds, log = terminated(viewer)
        assert (status, log.count("Traceback")) == (0, 0)
        assert seconds < END_S


def _count(event: Received, service: str, name: str) -> int:
    match event:
        case Envelope(message=m.Health() as health) if health.service == service:
            return health.counts.get(name, 0)
        case _:
            return 0


def test_all_roles_end_with_sigterm(start: Start, endpoint: str, tmp_path: Path) -> None:
    router = start("router")
    with ZenohBus.open(client(endpoint), RIG, RealClock()) as bus:
        bus.subscribe(ASSIGNMENT)
        viewer, integrator = start("viewer", "1", "30"), start("integrator", str(tmp_path / "take.mcap"))
        awaited(bus, m.Assignment)
    ends = [terminated(process) for process in (viewer, integrator, router)]
    assert [status for status, _, _ in ends] == [0, 0, 0]
    assert max(seconds for _, seconds, _ in ends) < END_S
    take = TakeReader(tmp_path / "take.mcap")
    assert list(take.messages())
    assert take.cut is None


def test_service_without_a_router_stops_on_sigterm(start: Start) -> None:
    viewer = start("viewer", "1", "30")
    with pytest.raises(subprocess.TimeoutExpired):
        viewer.communicate(timeout=8.0)
    status, seconds, log = terminated(viewer)
    assert status == 1
    assert "stopped while waiting for a Zenoh router" in log
    assert seconds < END_S


def test_services_reconnect_to_a_restarted_router(endpoint: str) -> None:
    first = open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False))
    with ZenohBus.open(client(endpoint), RIG, RealClock()) as sender:
        sender.publish(PARTIAL_BDP, bdp("1"))
        with ZenohBus.open(client(endpoint), RIG, RealClock()) as reader:
            reader.subscribe(PARTIAL_BDP)
            awaited(reader, m.PartialBdp)
            first.close()
            changed = m.PartialBdp(frame=9, captured_ns=0, viewer="1", side="side", lengths={})
            sender.publish(PARTIAL_BDP, changed)
            with router(endpoint):
                assert awaited(reader, m.PartialBdp) == changed


def test_restarted_publisher_replaces_its_latched_state(opened: Open) -> None:
    reader = opened()
    reader.subscribe(PARTIAL_BDP)
    for frame in (5, 3, 1):
        message = m.PartialBdp(frame=frame, captured_ns=0, viewer="1", side="side", lengths={})
        with opened() as sender:
            sender.publish(PARTIAL_BDP, message)
            assert awaited(reader, m.PartialBdp) == message


def test_older_of_two_equal_services_continues_after_a_network_split(endpoint: str) -> None:
    with (
        ZenohBus.open(client(endpoint, "peer"), RIG, RealClock()) as older,
        ZenohBus.open(client(endpoint, "peer"), RIG, RealClock()) as newer,
    ):
        older.declare_alive("viewer", "1")
        newer.declare_alive("viewer", "1")
        assert newer.receive(0.0) is None
        with router(endpoint):
            with pytest.raises(DuplicateService, match=f"viewer 1 of rig {RIG} is already running"):
                wait_for(newer, lambda _: False)
            assert older.receive(0.0) is None


OLD_NS = 1_600_000_000_000_000_000


@pytest.mark.parametrize("start_ns", [0, OLD_NS, time.time_ns()], ids=["zero", "years ago", "recent"])
def test_a_token_of_an_earlier_claim_stops_no_service(routed: ZenohOptions, start_ns: int) -> None:
    """Any program can declare a token; only a session that answers for its own claim counts."""
    token = CLAIM.format(rig=RIG, service="viewer", id="1", claim=f"{start_ns:020d}-{{zid}}")
    alive = ALIVE.format(rig=RIG, service="viewer", id="1")
    with open_session(routed) as foreign, ZenohBus.open(routed, RIG, RealClock()) as running:
        running.declare_alive("viewer", "1")
        stranger = "0" * 31 + "1"
        tokens = [foreign.liveliness().declare_token(token.format(zid=zid)) for zid in (foreign.zid(), stranger, "x")]
        tokens.append(foreign.liveliness().declare_token(alive))

        def reply(query: zenoh.Query) -> None:  # for the claim of another session
            with query:
                query.reply(token.format(zid=stranger), b"")

        foreign.declare_queryable(token.format(zid=stranger), reply)
        end_s = time.monotonic() + 3.0
        while time.monotonic() < end_s:
            running.receive(0.1)
        running.close()
        with ZenohBus.open(routed, RIG, RealClock()) as restarted:  # nor does it prevent a start
            restarted.declare_alive("viewer", "1")
            with ZenohBus.open(routed, RIG, RealClock()) as second, pytest.raises(DuplicateService):
                second.declare_alive("viewer", "1")
        assert len(tokens) == 4


def test_queueing_latest_all_and_every_over_the_network(opened: Open) -> None:
    sender, reader = opened(), opened()
    with reader.reader() as log:
        reader.subscribe(SIGHTING, viewer="1")
        reader.subscribe(UNIVERSAL_BAP)
        log.subscribe(SIGHTING, every=True)
        log.subscribe(UNIVERSAL_BAP, every=True)
        for name in ("1", "2"):
            _publish_until_received(sender, reader if name == "1" else log, name)
        _all(reader)
        before = reader.counters.dropped.get("superseded", 0)
        everything: list[Received] = []
        for frame in range(100, 120):  # a burst may be dropped on the way
            sender.publish(SIGHTING, sighting("1", frame))
            sender.publish(UNIVERSAL_BAP, bap(frame))
            everything += [wait_for(log, lambda event: _frame(event) >= 100) for _ in range(2)]
        sent = [(key, frame) for frame in range(100, 120) for key in (SIGHTING.on(RIG, viewer="1"), UNIVERSAL_BAP.on(RIG))]
        assert [(event.key, _frame(event)) for event in everything if isinstance(event, Envelope)] == sent
        # The reader has its own connection: its newest sighting arrives when the 19 before it were superseded.
        until(lambda: reader.counters.dropped.get("superseded", 0) >= before + 19, "sightings are superseded")
        received: list[Received] = []
        while sum(map(carries(m.UniversalBap), received)) < 20:
            received.append(wait_for(reader, lambda event: _frame(event) >= 100))
        received += _all(reader)
        assert [_frame(event) for event in received if carries(m.UniversalBap)(event)] == list(range(100, 120))
        assert [_frame(event) for event in received if carries(m.Sighting)(event)] == [119]
        assert reader.counters.rejected == {}


def _frame(event: Received) -> int:
    return event.message.frame if isinstance(event, Envelope) else -1


def _all(bus: ZenohBus) -> list[Received]:
    return list(iter(lambda: bus.receive(0.0), None))


def _publish_until_received(sender: ZenohBus, reader: ZenohBus, viewer: str) -> None:
    """Publish until a first message arrives: subscriptions take a moment to reach the sender."""
    for frame in range(round(PATIENCE_S / 0.1)):
        sender.publish(SIGHTING, sighting(viewer, frame))
        if reader.receive(0.1) is not None:
            return
    pytest.fail("the reader receives nothing")


def test_clock_queries_are_answered_with_ordered_times(opened: Open) -> None:
    clock_server, querier = opened(), opened()
    clock_server.serve_clock()
    trips: list[RoundTrip] = []

    def three() -> bool:
        querier.query_clock()
        if isinstance(trip := querier.receive(0.1), RoundTrip):
            trips.append(trip)
        return len(trips) == 3

    until(three, "answers")
    assert all(trip.sent_ns <= trip.answered_ns <= trip.received_ns for trip in trips)


def test_invalid_clock_queries_are_rejected(opened: Open, routed: ZenohOptions) -> None:
    clock_server = opened()
    clock_server.serve_clock()
    with open_session(routed) as foreign:

        def rejected() -> bool:
            list(foreign.get(f"zenocap/{RIG}/integrator/clock", payload=b"\x91" * 9, timeout=0.2))
            return bool(clock_server.counters.rejected)

        until(rejected, "a rejected query")
        assert set(clock_server.counters.rejected) == {"invalid"}


def forged(query: zenoh.Query, *times_ns: int, frame: int = 0) -> None:
    """Answer a query of the clock.  frame: by which that of the query is changed."""
    with query:
        for time_ns in times_ns:
            asked = codec.decode(query.payload.to_bytes(), m.ClockQuery)
            changed = plain(asked) | {"frame": asked.frame + frame, "captured_ns": time_ns}
            query.reply(query.key_expr, msgpack.packb(changed))


FALSE_ANSWERS: dict[str, tuple[set[str], Callable[[zenoh.Query], object]]] = {
    "another time": ({"names"}, lambda query: forged(query, time.time_ns() + 3600 * 10**9)),
    "many times": ({"names"}, lambda query: forged(query, *range(500))),
    "no time of a clock": ({"invalid"}, lambda query: forged(query, 2**63 - 1)),
    "an earlier answer": (set(), lambda query: forged(query, time.time_ns() - 10**9, frame=1)),
    "a huge answer": ({"invalid"}, lambda query: query.reply(query.key_expr, bytes(HUGE_BYTES))),
    "none": (set(), lambda query: held.append(query)),
}
held: list[zenoh.Query] = []  # queries without an answer


@pytest.mark.parametrize("what", FALSE_ANSWERS)
@pytest.mark.parametrize("first", [True, False], ids=["before the integrator", "after it"])
def test_a_false_clock_answer_moves_no_time(
    what: str, opened: Open, routed: ZenohOptions, stack: ExitStack, *, first: bool
) -> None:
    """The router asked one of several programs, the one that had connected first."""
    reasons, answer = FALSE_ANSWERS[what]
    trips: list[RoundTrip] = []
    asked = threading.Event()

    def reply(query: zenoh.Query) -> None:
        asked.set()
        answer(query)

    def stranger() -> None:
        session = stack.enter_context(open_session(routed))
        session.declare_queryable(CLOCK.format(rig=RIG), reply, complete=True)

    for join in (stranger, lambda: opened().serve_clock()) if first else (lambda: opened().serve_clock(), stranger):
        join()
    querier = opened()

    def three() -> bool:
        querier.query_clock()
        if isinstance(trip := querier.receive(1.0), RoundTrip) and asked.is_set():
            trips.append(trip)
        return len(trips) >= 3 and querier.counters.rejected.keys() == reasons

    until(three, f"answers, and {reasons} rejected: {querier.counters}")
    held.clear()
    assert all(trip.sent_ns <= trip.answered_ns <= trip.received_ns for trip in trips)


def test_observer_finds_every_rig_and_receives_each_separately(routed: ZenohOptions) -> None:
    clock = RealClock()
    with ZenohBus.open(routed, "observer", clock) as observer:
        for rig in ("studio", "lab"):
            with ZenohBus.open(routed, rig, clock) as bus:
                bus.declare_alive("viewer", "1")
                _wait_for_rigs(observer, {rig})
                with observer.reader_of(rig) as rig_bus:
                    rig_bus.subscribe(UNIVERSAL_BAP)
                    rig_bus.watch_alive()
                    wait_for(rig_bus, lambda event: isinstance(event, Alive) and event.alive)
                    bus.publish(UNIVERSAL_BAP, bap(7))
                    assert wait_for(rig_bus, carries(m.UniversalBap)).key == f"zenocap/{rig}/integrator/bap"
        _wait_for_rigs(observer, set())
        with pytest.raises(ValueError, match="rig"):
            observer.reader_of("*")


def _wait_for_rigs(observer: ZenohBus, expected: set[str]) -> None:
    """Wait until the observer finds exactly these rigs: liveliness takes a moment to reach it."""
    until(lambda: observer.rigs() == expected, f"{expected} found")


def test_liveliness_tokens_with_invalid_names_are_ignored(routed: ZenohOptions) -> None:
    """The reader of all rigs ended with a ValueError, and the names reached the terminal."""
    with ZenohBus.open(routed, "names", RealClock()) as watching, open_session(routed) as hostile:
        watching.watch_alive()
        keys = [ALIVE.format(rig=rig, service="viewer", id="1") for rig in ("a b", "\x1b[2J", "x" * 65, "good")]
        keys += [
            ALIVE.format(rig="names", service=service, id=id) for service, id in (("vi\x1bewer", "1"), ("viewer", "a b"))
        ]
        keys.append(ALIVE.format(rig="names", service="viewer", id="last"))
        tokens = [hostile.liveliness().declare_token(key) for key in keys]
        _wait_for_rigs(watching, {"good", "names"})
        seen = []
        while "last" not in seen:
            event = watching.receive(PATIENCE_S)
            assert isinstance(event, Alive)
            seen.append(event.id)
        assert seen == ["last"]
        assert watching.counters.rejected.keys() == {"names"}
        assert watching.counters.rejected["names"] >= 2  # Zenoh may report an existing token twice
        assert len(tokens) == len(keys)
