"""A mesh of peers over loopback without router or multicast: listen and connect endpoints of each."""

from collections.abc import Sequence
from dataclasses import dataclass

from zenocap.common.bus.zenoh_session import HOST


@dataclass(frozen=True)
class Peer:
    """One member of the mesh.  listen, connect: Zenoh endpoints."""

    listen: str
    connect: tuple[str, ...]


def peer_mesh(ports: Sequence[int], protocol: str = "tcp") -> list[Peer]:
    """One peer per port, which connects to all previous ones, so that each pair has one link."""
    endpoints = [f"{protocol}/{HOST}:{port}" for port in ports]
    return [Peer(endpoint, tuple(endpoints[:k])) for k, endpoint in enumerate(endpoints)]
