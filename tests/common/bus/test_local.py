"""The bus inside one process behaves as the network does, in order and without delay."""

import pytest

from tests.common.bus.test_inbox import bap, sighting
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Alive, DuplicateService, Envelope, RoundTrip
from zenocap.common.codec import BadMessage, encode
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import PARTIAL_BDP, SIGHTING, UNIVERSAL_BAP


def bdp(viewer: str, frame: int) -> m.PartialBdp:
    return m.PartialBdp(frame=frame, captured_ns=frame, viewer=viewer, side="front", lengths={"torso": 0.5})


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", ManualClock(1000))


def received(bus: LocalBus) -> list[m.Message]:
    return [event.message for event in iter(bus.receive, None)]


def test_received_envelope_equals_that_of_the_network(network: LocalNetwork) -> None:
    viewer, integrator = network.bus(), network.bus()
    integrator.subscribe(SIGHTING)
    viewer.publish(SIGHTING, sighting("1", 5))
    event = integrator.receive()
    assert event == Envelope("zenocap/studio/viewer/1/sighting", SIGHTING, sighting("1", 5), 1000)
    assert event.data == encode(sighting("1", 5))
    viewer.forward(SIGHTING, "zenocap/studio/viewer/1/sighting", event.data)
    assert integrator.receive() == event


def test_subscription_to_one_viewer_receives_only_that_viewer(network: LocalNetwork) -> None:
    viewer, integrator = network.bus(), network.bus()
    integrator.subscribe(SIGHTING, viewer="2")
    viewer.publish(SIGHTING, sighting("1", 5))
    viewer.publish(SIGHTING, sighting("2", 6))
    assert received(integrator) == [sighting("2", 6)]


def test_late_subscriber_receives_the_latched_message_published_or_forwarded(network: LocalNetwork) -> None:
    network.bus().publish(PARTIAL_BDP, bdp("1", 1))
    network.bus().publish(PARTIAL_BDP, bdp("1", 2))
    network.bus().forward(PARTIAL_BDP, "zenocap/studio/viewer/2/bdp", encode(bdp("2", 3)))
    late = network.bus()
    late.subscribe(PARTIAL_BDP)
    assert received(late) == [bdp("1", 2), bdp("2", 3)]


def test_an_invalid_value_and_an_invalid_rig_name_raise_an_error(network: LocalNetwork) -> None:
    with pytest.raises(BadMessage, match=r"\$\.frame"):
        network.bus().publish(SIGHTING, sighting("1", -1))
    with pytest.raises(ValueError, match="viewer = ''"):
        network.bus().publish(SIGHTING, sighting("", 1))
    with pytest.raises(ValueError, match="rig = 'a/b'"):
        LocalNetwork("a/b", ManualClock())


def test_liveliness_changes_are_received_as_events(network: LocalNetwork) -> None:
    viewer, integrator = network.bus(), network.bus()
    viewer.declare_alive("viewer", "1")
    integrator.watch_alive()
    viewer.close()
    assert list(iter(integrator.receive, None)) == [Alive("viewer", "1", alive, 1000) for alive in (True, False)]


def test_a_second_service_of_a_name_is_refused(network: LocalNetwork) -> None:
    first = network.bus()
    first.declare_alive("viewer", "1")
    with pytest.raises(DuplicateService, match="viewer 1 of rig studio is already running"):
        network.bus().declare_alive("viewer", "1")
    first.close()
    network.bus().declare_alive("viewer", "1")
    assert ("viewer", "1") in network.alive


def test_a_round_trip_compares_two_clocks(network: LocalNetwork) -> None:
    network.bus().serve_clock()
    ahead = network.bus(ManualClock(1500))
    ahead.query_clock()
    assert ahead.receive() == RoundTrip(1500, 1000, 1500)


def test_a_reader_has_its_own_queue(network: LocalNetwork) -> None:
    bus = network.bus()
    log = bus.reader()
    log.subscribe(UNIVERSAL_BAP, every=True)
    bus.publish(UNIVERSAL_BAP, bap(1))
    assert received(bus) == []
    assert received(log) == [bap(1)]


@pytest.mark.parametrize("key", ["zenocap/other/viewer/1/sighting", "zenocap/studio/viewer/1/bap", "sighting"])
def test_forwarding_on_an_unknown_key_raises_an_error(network: LocalNetwork, key: str) -> None:
    for forward in (lambda: network.bus().forward(SIGHTING, key, b""), lambda: network.bus().announce(SIGHTING, key)):
        with pytest.raises(ValueError, match=f"{key}: no key of sighting of rig studio"):
            forward()


def test_flow_control_waits_until_a_service_has_handled_its_messages(network: LocalNetwork) -> None:
    player, integrator = network.bus(), network.bus()
    integrator.subscribe(SIGHTING)
    integrator.declare_alive("integrator", "main")
    main = ("integrator", "main")
    assert player.wait_until_handled([main, ("tracker", "main")], 1.0) == {main: frozenset()}
    player.publish(SIGHTING, sighting("1", 5))
    assert player.wait_until_handled([main], 1.0) == {}
    received(integrator)
    player.publish(UNIVERSAL_BAP, bap(1))
    player.publish(SIGHTING, sighting("1", 6))
    received(integrator)
    assert player.wait_until_handled([main], 1.0) == {main: {SIGHTING.at("studio", viewer="1")}}
