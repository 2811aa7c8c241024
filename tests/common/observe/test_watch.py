"""One connection that reads several rigs, given or found."""

import time
from collections.abc import Callable
from contextlib import ExitStack

import pytest

from tests.common.bus.test_inbox import bap, sighting
from zenocap.common.bus.protocol import Alive, Envelope, Received, RoundTrip
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports, open_session
from zenocap.common.observe import watch as watch_module
from zenocap.common.observe.watch import Watch
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import ALIVE, SIGHTING, UNIVERSAL_BAP
from zenocap.tools.record.launcher.peer_mesh import peer_mesh

RIGS = ("one", "two")
PATIENCE_S = 30.0


@pytest.mark.slow
@pytest.mark.parametrize("given", [RIGS, ("two",), ()])
def test_the_rigs_that_are_given_or_all_that_are_found_are_read(given: tuple[str, ...]) -> None:
    options = [
        ZenohOptions("peer", peer.connect, (peer.listen,), multicast_scouting=False) for peer in peer_mesh(free_ports(3))
    ]
    wanted, seen = given or RIGS, list[tuple[str, Received]]()
    with ExitStack() as stack:
        buses = [stack.enter_context(ZenohBus.open(one, rig, RealClock())) for one, rig in zip(options, RIGS, strict=False)]
        for bus in buses:
            bus.declare_alive("integrator", "main")
            bus.serve_clock()
        watch = stack.enter_context(Watch(options[2], "test", given, (UNIVERSAL_BAP,), lambda: False, clock=True))

        def until(done: Callable[[], bool]) -> None:
            end_s = time.monotonic() + PATIENCE_S
            while not done():
                assert time.monotonic() < end_s, seen
                for bus in buses:
                    bus.publish(UNIVERSAL_BAP, bap(1))
                    bus.publish(SIGHTING, sighting("1", 1))
                for rig, event, at_ns in watch.events():
                    assert at_ns <= RealClock().elapsed_ns()
                    seen.append((rig, event))
                time.sleep(0.02)

        for kind in (Alive, Envelope, RoundTrip):
            until(lambda kind=kind: {rig for rig, event in seen if isinstance(event, kind)} == set(wanted))  # type: ignore[misc]
    assert {event.topic for _, event in seen if isinstance(event, Envelope)} == {UNIVERSAL_BAP}
    assert all(event.key.split("/")[1] == rig for rig, event in seen if isinstance(event, Envelope))


@pytest.mark.slow
def test_invented_rigs_are_read_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """64 further ones were read each two seconds, without end."""
    monkeypatch.setattr(watch_module, "MAX_RIGS", 2)
    monkeypatch.setattr(watch_module, "SEARCH_NS", 0)
    place = f"tcp/127.0.0.1:{free_ports(1)[0]}"
    with open_session(ZenohOptions("peer", listen=(place,), multicast_scouting=False)) as session:
        tokens = [ALIVE.format(rig=f"r{number}", service="viewer", id="1") for number in range(4)]
        held = [session.liveliness().declare_token(token) for token in tokens]
        options, end_s = ZenohOptions("peer", (place,), multicast_scouting=False), time.monotonic() + PATIENCE_S
        with Watch(options, "test", (), (UNIVERSAL_BAP,), lambda: False) as watch:
            while len(watch._readers) < 2:
                assert time.monotonic() < end_s
                list(watch.events())
            list(watch.events())
            assert len(watch._readers) == 2
        assert len(held) == 4
