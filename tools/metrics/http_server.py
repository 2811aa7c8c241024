"""HTTP server of `/metrics`, with limits of threads and time."""

import socket
import threading
from socketserver import ThreadingMixIn
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from prometheus_client import CollectorRegistry
from prometheus_client.exposition import make_wsgi_app

from zenocap.tools.metrics.parameters import CONNECTION_TIMEOUT_S, MAX_CONNECTIONS


class _Handler(WSGIRequestHandler):
    timeout = CONNECTION_TIMEOUT_S  # of each read and write, so that a connection without a request ends

    def log_message(self, format: str, *args: Any) -> None:
        pass


class LimitedServer(ThreadingMixIn, WSGIServer):
    """Serves MAX_CONNECTIONS at a time and closes further ones at once.

    refused: number of these.  failed: connections that ended with an error, such as a reset.
    """

    daemon_threads = True

    def __init__(self, host: str, port: int) -> None:
        """Raises OSError and UnicodeError for an address that cannot be listened on."""
        self.address_family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
        self.refused = self.failed = 0
        self._places = threading.BoundedSemaphore(MAX_CONNECTIONS)
        super().__init__((host, port), _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._places.acquire(blocking=False):
            self.refused += 1
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        self.failed += 1


def start_server(host: str, port: int, registry: CollectorRegistry) -> tuple[LimitedServer, threading.Thread]:
    """Serve in a thread until `shutdown`.  Raises as `LimitedServer`."""
    server = LimitedServer(host, port)
    server.set_app(make_wsgi_app(registry))
    thread = threading.Thread(target=server.serve_forever, name="metrics", daemon=True)
    thread.start()
    return server, thread
