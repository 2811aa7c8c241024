"""Flow control over a network: answers come after all messages before the query."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.common.bus.test_inbox import sighting
from tests.support.live_cameras import until
from tests.support.networks import mesh, options_of
from tests.support.processes import PATIENCE_S
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.codec import encode
from zenocap.common.messages import PaceQuery
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import FLOW_CONTROL, SIGHTING

pytestmark = pytest.mark.nightly
RIG, MAIN = "pace", ("integrator", "main")
KEY = SIGHTING.at(RIG, viewer="1")
TOGETHER_S = 10.0  # for queries that are waited for together; one after the other they take 20 s (s)


@pytest.fixture
def buses() -> Iterator[tuple[ZenohBus, ZenohBus]]:
    """Player and service, connected."""
    one, two = map(options_of, mesh(2))
    with ZenohBus.open(one, RIG, RealClock()) as player, ZenohBus.open(two, RIG, RealClock()) as service:
        yield player, service


@contextmanager
def handling(bus: ZenohBus, handled: list[int], each_s: float = 0.0) -> Iterator[None]:
    """A thread that receives from `bus` and takes `each_s` per message."""
    stop = threading.Event()

    def work() -> None:
        while not stop.is_set():
            event = bus.receive(0.05)
            if isinstance(event, Envelope):
                time.sleep(each_s)
                handled.append(event.message.frame)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def wait_until_answered(player: ZenohBus) -> None:
    """Query until answered: the declaration of a queryable takes a moment to arrive."""
    until(lambda: player.wait_until_handled([MAIN], 1.0), "an answer")


def test_nothing_is_superseded_when_the_player_keeps_pace(buses: tuple[ZenohBus, ZenohBus]) -> None:
    player, service = buses
    handled: list[int] = []
    logged: list[int] = []
    log = service.reader()
    service.subscribe(SIGHTING)
    log.subscribe(SIGHTING)
    service.declare_alive(*MAIN)
    with handling(service, handled), handling(log, logged, each_s=0.002):
        wait_until_answered(player)
        handled.clear()
        logged.clear()
        for frame in range(200):
            player.forward(SIGHTING, KEY, encode(sighting("1", frame)))
            assert player.wait_until_handled([MAIN], PATIENCE_S) == {MAIN: {KEY}}
            assert (handled[-1], logged[-1]) == (frame, frame)
    assert handled == logged == list(range(200))
    assert service.counters.dropped == log.counters.dropped == {}


def test_closed_reader_is_not_waited_for(buses: tuple[ZenohBus, ZenohBus]) -> None:
    player, service = buses
    service.declare_alive(*MAIN)
    handled: list[int] = []
    with service.reader() as closed:
        closed.subscribe(SIGHTING)
    with handling(service, handled):
        wait_until_answered(player)
        player.forward(SIGHTING, KEY, encode(sighting("1", 1)))
        assert player.wait_until_handled([MAIN], PATIENCE_S) == {MAIN: set()}  # no subscriber is left


def test_services_that_do_not_answer_are_distinguished(buses: tuple[ZenohBus, ZenohBus]) -> None:
    player, service = buses
    service.declare_alive(*MAIN)
    service.declare_alive("tracker", "main")
    handled: list[int] = []
    with handling(service, handled):
        wait_until_answered(player)
        assert set(player.wait_until_handled([MAIN, ("recognizer", "main")], 2.0)) == {MAIN}
    assert player.wait_until_handled([MAIN], 0.2) == {}  # alive, but frozen


def test_queries_that_name_messages_never_sent_delay_no_other(buses: tuple[ZenohBus, ZenohBus]) -> None:
    """As from a hostile program: each of them waited by itself, so that `zenocap health` was not answered."""
    player, service = buses
    log = service.reader()
    service.subscribe(SIGHTING)
    log.subscribe(SIGHTING)
    service.declare_alive(*MAIN)
    with handling(service, []), handling(log, []):
        wait_until_answered(player)
        key = FLOW_CONTROL.format(rig=RIG, service=MAIN[0], id=MAIN[1])
        hostile = encode(PaceQuery(frame=0, captured_ns=0, sent={KEY: 10**9}))
        replies: list[float] = []
        started_s = time.monotonic()
        for _ in range(100):
            player._session.get(key, lambda _: replies.append(time.monotonic()), payload=hostile, timeout=PATIENCE_S)
        assert player.wait_until_handled([MAIN], PATIENCE_S) == {MAIN: frozenset()}
        while len(replies) < 100:
            assert time.monotonic() - started_s < TOGETHER_S
            time.sleep(0.01)
