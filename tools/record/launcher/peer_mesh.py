"""A mesh of peers over loopback without router or multicast: listen and connect endpoints of each."""

import socket
from collections.abc import Sequence
from dataclasses import dataclass

HOST = "127.0.0.1"


@dataclass(frozen=True)
class Peer:
    """One member of the mesh.  listen, connect: Zenoh endpoints."""

    listen: str
    connect: tuple[str, ...]


def peer_mesh(ports: Sequence[int], protocol: str = "tcp") -> list[Peer]:
    """One peer per port, which connects to all previous ones, so that each pair has one link."""
    endpoints = [f"{protocol}/{HOST}:{port}" for port in ports]
    return [Peer(endpoint, tuple(endpoints[:k])) for k, endpoint in enumerate(endpoints)]


def free_ports(count: int) -> list[int]:
    """Different free TCP ports of this machine."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind((HOST, 0))
        return [int(one.getsockname()[1]) for one in sockets]
    finally:
        for one in sockets:
            one.close()
