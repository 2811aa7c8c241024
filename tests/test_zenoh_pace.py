"""A service answers when it has handled everything: over a real network, with its own thread and a reader's."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from common.bus.protocol import Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.codec import encode
from common.runtime.clock import RealClock
from common.topics import SIGHTING
from services.launcher.mesh import free_ports, mesh
from tests.test_inbox import sighting

pytestmark = pytest.mark.system
RIG, MAIN = "pace", ("integrator", "main")
KEY = SIGHTING.at(RIG, viewer="1")


@pytest.fixture
def buses() -> Iterator[tuple[ZenohBus, ZenohBus]]:
    """Player and service, connected."""
    one, two = (
        ZenohOptions("peer", place.connect, (place.listen,), multicast_scouting=False) for place in mesh(free_ports(2))
    )
    with ZenohBus.open(one, RIG, RealClock()) as player, ZenohBus.open(two, RIG, RealClock()) as service:
        yield player, service


@contextmanager
def working(bus: ZenohBus, handled: list[int], each_s: float = 0.0) -> Iterator[None]:
    """A thread that receives from `bus` and takes `each_s` for a message."""
    over = threading.Event()

    def work() -> None:
        while not over.is_set():
            event = bus.receive(0.05)
            if isinstance(event, Envelope):
                time.sleep(each_s)
                handled.append(event.message.frame)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def until_answered(player: ZenohBus) -> None:
    """Its queryable takes a moment to be known."""
    end_s = time.monotonic() + 10
    while not player.pace([MAIN], 1.0):
        assert time.monotonic() < end_s


def test_nothing_is_superseded_when_the_player_keeps_pace(buses: tuple[ZenohBus, ZenohBus]) -> None:
    player, service = buses
    handled: list[int] = []
    logged: list[int] = []
    log = service.reader()
    service.subscribe(SIGHTING)
    log.subscribe(SIGHTING)
    service.declare_alive(*MAIN)
    with working(service, handled), working(log, logged, each_s=0.002):
        until_answered(player)
        handled.clear()
        logged.clear()
        for frame in range(200):
            player.forward(SIGHTING, KEY, encode(sighting("1", frame)))
            assert player.pace([MAIN], 2.0) == {MAIN: {KEY}}
            assert (handled[-1], logged[-1]) == (frame, frame)
    assert handled == logged == list(range(200))
    assert service.counters.dropped == log.counters.dropped == {}


def test_a_reader_that_was_closed_is_not_waited_for(buses: tuple[ZenohBus, ZenohBus]) -> None:
    player, service = buses
    service.declare_alive(*MAIN)
    handled: list[int] = []
    with service.reader() as gone:
        gone.subscribe(SIGHTING)
    with working(service, handled):
        until_answered(player)
        player.forward(SIGHTING, KEY, encode(sighting("1", 1)))
        assert player.pace([MAIN], 2.0) == {MAIN: set()}  # nobody listens to it any more


def test_who_does_not_answer_is_told_from_who_does(buses: tuple[ZenohBus, ZenohBus]) -> None:
    player, service = buses
    service.declare_alive(*MAIN)
    service.declare_alive("tracker", "main")
    handled: list[int] = []
    with working(service, handled):
        until_answered(player)
        assert set(player.pace([MAIN, ("recognizer", "main")], 2.0)) == {MAIN}
    assert player.pace([MAIN], 0.2) == {}  # alive, but frozen
