"""One deadline for a whole HTTP request: the time-out of a connection holds for each read."""

import http.client
import socket
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from time import monotonic


@contextmanager
def connected(connection: http.client.HTTPConnection, seconds: float) -> Iterator[None]:
    """Connect; close the connection at the end, and after `seconds` at the latest, however slowly an answer comes.

    Raises OSError; TimeoutError after `seconds`.
    """
    end_s, late = monotonic() + seconds, threading.Event()
    with closing(connection):
        connection.connect()
        link = connection.sock

        def end() -> None:
            late.set()
            with suppress(OSError):  # it is closed already
                link.shutdown(socket.SHUT_RDWR)

        timer = threading.Timer(max(0.0, end_s - monotonic()), end)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            if late.is_set():
                raise TimeoutError("timed out")
