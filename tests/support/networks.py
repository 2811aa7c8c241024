"""Zenoh networks on this machine: endpoints, options of members, a router, what a bus receives."""

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from tests.support.processes import PATIENCE_S, M
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope, Received
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import Mode, ZenohOptions, free_ports, open_session
from zenocap.tools.record.launcher.peer_mesh import Peer, peer_mesh

Condition = Callable[[Received], bool]


def free_endpoint() -> str:
    return f"tcp/127.0.0.1:{free_ports(1)[0]}"


def listens(endpoint: str) -> bool:
    """Whether a program accepts connections at an endpoint."""
    host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
    with socket.socket() as probe:
        return probe.connect_ex((host, int(port))) == 0


def client(endpoint: str, mode: Mode = "client") -> ZenohOptions:
    return ZenohOptions(mode, connect=(endpoint,), multicast_scouting=False)


def listener(endpoint: str) -> ZenohOptions:
    """Options of a peer to which others connect."""
    return ZenohOptions("peer", listen=(endpoint,), multicast_scouting=False)


@contextmanager
def router(endpoint: str) -> Iterator[ZenohOptions]:
    """Options of a client of a router in this process."""
    with open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)):
        yield client(endpoint)


def mesh(count: int) -> list[Peer]:
    return peer_mesh(free_ports(count))


def options_of(peer: Peer) -> ZenohOptions:
    return ZenohOptions("peer", peer.connect, (peer.listen,), multicast_scouting=False)


def arguments_of(peer: Peer) -> list[object]:
    """The same options for a command."""
    connect = [word for endpoint in peer.connect for word in ("--connect", endpoint)]
    return ["--no-multicast-scouting", "--listen", peer.listen, *connect]


def wait_for(bus: ZenohBus, condition: Condition, count: int = 1) -> Received:
    """The last of the next `count` events that meet a condition; fails after PATIENCE_S."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        event = bus.receive(0.1)
        if event is not None and condition(event):
            count -= 1
            if count == 0:
                return event
    pytest.fail(f"{count} events not received within {PATIENCE_S} s")


def awaited(bus: ZenohBus, kind: type[M], least_frame: int = 0) -> M:
    """The next message of a type, from a frame on."""
    return wait_for(bus, carries(kind, least_frame)).message


def carries(kind: type[m.Message], least_frame: int = 0) -> Condition:
    """Condition of an event: a message of a type, from a frame on."""

    def condition(event: Received) -> bool:
        return isinstance(event, Envelope) and isinstance(event.message, kind) and event.message.frame >= least_frame

    return condition


def is_whole(event: Received) -> bool:
    """Condition of an event: a pose to which all viewers contribute."""
    match event:
        case Envelope(message=m.UniversalBap(stale=[])):
            return True
    return False
