"""Visitors of a page that misbehave: many connections, malformed requests, a page that never reads."""

import random
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from urllib.error import URLError
from urllib.request import urlopen

CONNECTIONS = 600
REQUESTS_PER_S = 200.0
NEVER_READING = 8
HANDSHAKE = (
    "GET /socket HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


def visit(kind: str, port: int, rng: random.Random, ended: threading.Event) -> int:
    """Visit the page until `ended`; returns the number of connections that were opened."""
    held: list[socket.socket] = []
    try:
        match kind:
            case "connections":
                opened = sum(_connected(port, held) for _ in range(CONNECTIONS))
            case "never reads":
                opened = sum(_connected(port, held) for _ in range(NEVER_READING))
                for one in held:
                    with suppress(OSError):
                        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                        one.sendall(HANDSHAKE.format(port=port).encode())
            case "requests":
                opened = _repeat(ended, lambda: _request(port, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"))
            case _:
                opened = _repeat(ended, lambda: _request(port, rng.randbytes(rng.randint(1, 2000)) + b"\r\n\r\n"))
        ended.wait()
        return opened
    finally:
        for one in held:
            one.close()


def answers(port: int, timeout_s: float = 2.0) -> bool:
    """Whether the page is served."""
    try:
        with urlopen(f"http://127.0.0.1:{port}/", timeout=timeout_s) as reply:
            return bool(reply.status == 200)
    except (URLError, OSError):
        return False


def _connected(port: int, held: list[socket.socket]) -> bool:
    with suppress(OSError):
        held.append(socket.create_connection(("127.0.0.1", port), 1.0))
        return True
    return False


def _request(port: int, data: bytes) -> bool:
    with suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0) as one:
        one.sendall(data)
        while one.recv(1 << 16):
            pass
        return True
    return False


def _repeat(ended: threading.Event, request: Callable[[], bool]) -> int:
    count, begin_s, number = 0, time.monotonic(), 0
    while not ended.is_set():
        count += request()
        number += 1
        ended.wait(max(0.0, begin_s + number / REQUESTS_PER_S - time.monotonic()))
    return count
