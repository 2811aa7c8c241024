"""Real receivers of commands: an HTTP server on loopback, a UDP socket, programs."""

import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from zenocap.common.messages import Posture

SECOND = 1_000_000_000


@dataclass
class HttpReceiver:
    """url: of the server.  requests: method, path and body of each.  status: of the replies; None for no reply."""

    url: str = ""
    requests: list[tuple[str, str, str]] = field(default_factory=list)
    status: int | None = 204
    released: threading.Event = field(default_factory=threading.Event)


@contextmanager
def http_receiver() -> Iterator[HttpReceiver]:
    """A server that keeps its requests; without a status it replies when it is closed."""
    receiver = HttpReceiver()

    class Handler(BaseHTTPRequestHandler):
        def _keep(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", "0"))).decode()
            receiver.requests.append((self.command, self.path, body))
            if receiver.status is None:
                receiver.released.wait(30)
            self.send_response(receiver.status or 204)
            self.send_header("Location", "http://example.org/")
            self.end_headers()

        do_GET = do_POST = _keep

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    receiver.url = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    try:
        yield receiver
    finally:
        receiver.released.set()
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def dripping_server() -> Iterator[str]:
    """Host and port of a server that answers one request with a byte each 50 ms, for 3 s."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def drip() -> None:
            link, _ = server.accept()
            with link, suppress(OSError):  # the other side has closed it
                link.recv(65536)
                for byte in b"HTTP/1.1 200 OK\r\nX: ".ljust(60, b"a"):
                    link.sendall(bytes([byte]))
                    time.sleep(0.05)

        thread = threading.Thread(target=drip, daemon=True)
        thread.start()
        yield f"127.0.0.1:{server.getsockname()[1]}"
        thread.join()


@contextmanager
def udp_receiver(port: int = 0) -> Iterator[socket.socket]:
    """port: any free one for 0."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", port))
        receiver.settimeout(5.0)
        yield receiver


def free_tcp_port() -> int:
    """A port on which no program listens."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def program(folder: Path, name: str, script: str) -> str:
    """Path of an executable shell script."""
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n")
    os.chmod(path, 0o700)
    return str(path)


def posture_at(captured_ns: int, label: str | None = "squat") -> Posture:
    """Posture of 2 s that ended 0.3 s before the pose by which it was recognized."""
    return Posture(
        frame=7, captured_ns=captured_ns, label=label, start_ns=captured_ns - 23 * SECOND // 10,
        end_ns=captured_ns - 3 * SECOND // 10, log_likelihoods={"squat": -10.0, "kick": -20.0}, score=0.9, margin=1.2,
    )  # fmt: skip
