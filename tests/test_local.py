"""The bus inside one process behaves as the network does, only in order and at once."""

import pytest

from common import messages as m
from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Alive, DuplicateService, Envelope, RoundTrip
from common.codec import BadMessage, encode
from common.runtime.clock import ManualClock
from common.topics import PARTIAL_BDP, SIGHTING, UNIVERSAL_BAP
from tests.test_inbox import bap, sighting


def bdp(viewer: str, frame: int) -> m.PartialBdp:
    return m.PartialBdp(
        frame=frame, captured_ns=frame, viewer=viewer, side="front", height_px=90.0, score=0.9, lengths={"torso": 0.5}
    )


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", ManualClock(1000))


def received(bus: LocalBus) -> list[m.Message]:
    found = []
    while (event := bus.receive()) is not None:
        assert isinstance(event, Envelope)
        found.append(event.message)
    return found


def test_a_message_comes_as_it_would_from_the_network(network: LocalNetwork) -> None:
    viewer, integrator = network.bus(), network.bus()
    integrator.subscribe(SIGHTING)
    viewer.publish(SIGHTING, sighting("1", 5))
    event = integrator.receive()
    assert event == Envelope("zenocap/studio/viewer/1/sighting", SIGHTING, sighting("1", 5), 1000)
    assert isinstance(event, Envelope)
    assert event.data == encode(sighting("1", 5))


def test_only_the_named_viewer_is_heard(network: LocalNetwork) -> None:
    viewer, integrator = network.bus(), network.bus()
    integrator.subscribe(SIGHTING, viewer="2")
    viewer.publish(SIGHTING, sighting("1", 5))
    viewer.publish(SIGHTING, sighting("2", 6))
    assert received(integrator) == [sighting("2", 6)]


def test_latest_and_all(network: LocalNetwork) -> None:
    sender, reader = network.bus(), network.bus()
    reader.subscribe(SIGHTING)
    reader.subscribe(UNIVERSAL_BAP)
    for frame in range(3):
        sender.publish(SIGHTING, sighting("1", frame))
        sender.publish(UNIVERSAL_BAP, bap(frame))
    assert received(reader) == [sighting("1", 2), bap(0), bap(1), bap(2)]


def test_who_joins_late_gets_what_is_kept(network: LocalNetwork) -> None:
    network.bus().publish(PARTIAL_BDP, bdp("1", 1))
    network.bus().publish(PARTIAL_BDP, bdp("1", 2))
    late = network.bus()
    late.subscribe(PARTIAL_BDP)
    assert received(late) == [bdp("1", 2)]


def test_bad_bytes_are_rejected(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(SIGHTING)
    reader.hear("zenocap/studio/viewer/1/sighting", b"nonsense")
    assert received(reader) == []
    assert reader.counters.rejected == {"invalid": 1}


def test_a_bad_value_is_refused_to_its_sender(network: LocalNetwork) -> None:
    with pytest.raises(BadMessage, match=r"\$\.frame"):
        network.bus().publish(SIGHTING, sighting("1", -1))
    with pytest.raises(ValueError, match="viewer = ''"):
        network.bus().publish(SIGHTING, sighting("", 1))


def test_alive_is_told_to_those_who_watch(network: LocalNetwork) -> None:
    viewer, integrator = network.bus(), network.bus()
    viewer.declare_alive("viewer", "1")
    integrator.watch_alive()
    viewer.close()
    assert [integrator.receive(), integrator.receive(), integrator.receive()] == [
        Alive("viewer", "1", True, 1000),
        Alive("viewer", "1", False, 1000),
        None,
    ]


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
    ahead.ask_clock()
    assert ahead.receive() == RoundTrip(1500, 1000, 1500)


def test_a_reader_has_its_own_queue(network: LocalNetwork) -> None:
    bus = network.bus()
    log = bus.reader()
    log.subscribe(UNIVERSAL_BAP, every=True)
    bus.publish(UNIVERSAL_BAP, bap(1))
    assert received(bus) == []
    assert received(log) == [bap(1)]


def test_a_rig_needs_a_proper_name() -> None:
    with pytest.raises(ValueError, match="rig = 'a/b'"):
        LocalNetwork("a/b", ManualClock())


def test_forwarded_bytes_arrive_as_they_are(network: LocalNetwork) -> None:
    player, reader = network.bus(), network.bus()
    reader.subscribe(SIGHTING)
    data = encode(sighting("1", 5))
    player.forward(SIGHTING, "zenocap/studio/viewer/1/sighting", data)
    event = reader.receive()
    assert isinstance(event, Envelope)
    assert event.data == data


def test_forwarded_state_is_kept_for_late_joiners(network: LocalNetwork) -> None:
    network.bus().forward(PARTIAL_BDP, "zenocap/studio/viewer/1/bdp", encode(bdp("1", 3)))
    late = network.bus()
    late.subscribe(PARTIAL_BDP)
    assert received(late) == [bdp("1", 3)]


@pytest.mark.parametrize("key", ["zenocap/other/viewer/1/sighting", "zenocap/studio/viewer/1/bap", "sighting"])
def test_bytes_are_not_forwarded_on_a_strange_key(network: LocalNetwork, key: str) -> None:
    with pytest.raises(ValueError, match=f"{key}: no key of sighting of rig studio"):
        network.bus().forward(SIGHTING, key, b"")
    with pytest.raises(ValueError, match=f"{key}: no key of sighting of rig studio"):
        network.bus().announce(SIGHTING, key)


def test_a_service_keeps_pace_when_it_has_handled_everything(network: LocalNetwork) -> None:
    player, integrator = network.bus(), network.bus()
    integrator.subscribe(SIGHTING)
    integrator.declare_alive("integrator", "main")
    main = ("integrator", "main")
    assert player.pace([main, ("tracker", "main")], 1.0) == {main: frozenset()}
    player.publish(SIGHTING, sighting("1", 5))
    assert player.pace([main], 1.0) == {}
    received(integrator)
    player.publish(UNIVERSAL_BAP, bap(1))
    player.publish(SIGHTING, sighting("1", 6))
    received(integrator)
    assert player.pace([main], 1.0) == {main: {SIGHTING.at("studio", viewer="1")}}
