"""A mesh of peers over loopback without router or multicast: who listens where, and whom each one calls."""

import socket
from collections.abc import Sequence
from dataclasses import dataclass

HOST = "127.0.0.1"


@dataclass(frozen=True)
class Place:
    """One member of the mesh.  listen, connect: Zenoh endpoints."""

    listen: str
    connect: tuple[str, ...]


def mesh(ports: Sequence[int], protocol: str = "tcp") -> list[Place]:
    """A place for each port: everybody calls those before it, so that each pair has one link."""
    endpoints = [f"{protocol}/{HOST}:{port}" for port in ports]
    return [Place(endpoint, tuple(endpoints[:k])) for k, endpoint in enumerate(endpoints)]


def free_ports(count: int) -> list[int]:
    """Different TCP ports of this machine that nobody listens on now."""
    sockets = [socket.socket() for _ in range(count)]
    try:
        for one in sockets:
            one.bind((HOST, 0))
        return [int(one.getsockname()[1]) for one in sockets]
    finally:
        for one in sockets:
            one.close()
