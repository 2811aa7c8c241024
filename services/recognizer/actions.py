"""Actions of commands: Zenoh put, OSC message, UDP datagram, HTTP request, program.

Each function blocks until the action is done, at most for its timeout, and raises ActionFailed with one line of text.
`on_sent` is called when the action takes effect: put, datagram or request sent, program started.
"""

import http.client
import os
import signal
import socket
import subprocess
import tempfile
import threading
from collections.abc import Callable, Mapping
from urllib.parse import urlsplit

from zenocap.common.bus.protocol import BusError
from zenocap.common.formats.osc import osc_message
from zenocap.common.rig.commands import HttpAction, OscAction, ProgramAction, UdpAction, ZenohAction, is_loopback_url
from zenocap.common.runtime.http_deadline import connected
from zenocap.services.recognizer.parameters import MAX_ERROR_BYTES

Put = Callable[[str, bytes], None]
EXPECTED_STATUS = range(200, 300)


class ActionFailed(Exception):
    """An action was not done; the text is the reason, in one line."""


def put(action: ZenohAction, put_bytes: Put, on_sent: Callable[[], None]) -> None:
    """Put the payload, UTF-8, on the key."""
    try:
        put_bytes(action.key, action.payload.encode())
    except BusError as error:
        raise ActionFailed(str(error)) from error
    on_sent()


def send_osc(action: OscAction, on_sent: Callable[[], None]) -> None:
    """Send one datagram; whether it is received is not known."""
    _send_datagram(action.host, action.port, osc_message(action.address, *action.arguments))
    on_sent()


def send_udp(action: UdpAction, on_sent: Callable[[], None]) -> None:
    """Send the payload, UTF-8, as one datagram; whether it is received is not known."""
    _send_datagram(action.host, action.port, action.payload.encode())
    on_sent()


def _send_datagram(host: str, port: int, data: bytes) -> None:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, protocol) as sender:
            sender.sendto(data, address)
    except (OSError, UnicodeError) as error:
        raise ActionFailed(_reason(error)) from error


def request_http(action: HttpAction, on_sent: Callable[[], None]) -> None:
    """Send the request and wait for the status; redirections are not followed, proxies are not used."""
    if not is_loopback_url(action.url):
        raise ActionFailed("not an address of this machine")
    parts = urlsplit(action.url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port or 80, timeout=action.timeout)
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    body = action.body.encode() if action.method == "POST" else None
    headers = {"Content-Type": "text/plain; charset=utf-8"} if body is not None else {}
    try:
        with connected(connection, action.timeout):
            connection.request(action.method, path, body, headers)
            on_sent()
            status = connection.getresponse().status
    except (OSError, http.client.HTTPException) as error:
        raise ActionFailed(_reason(error)) from error
    if status not in EXPECTED_STATUS:
        raise ActionFailed(f"HTTP status {status}")


class ProgramRunner:
    """Runs one program at a time.  `run` is called by one thread, `stop` by another."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def run(self, action: ProgramAction, variables: Mapping[str, str], on_sent: Callable[[], None]) -> None:
        """Run the program without a shell, in a process group of its own, which is killed after the timeout.

        variables: added to the environment.  Its output is discarded; the end of its standard error is in the failure.
        """
        with tempfile.TemporaryFile() as errors:
            with self._lock:
                if self._stopped:
                    raise ActionFailed("the recognizer is stopping")
                try:
                    process = self._process = subprocess.Popen(
                        [action.program, *action.arguments], env={**os.environ, **variables}, stdin=subprocess.DEVNULL,
                        stdout=subprocess.DEVNULL, stderr=errors, start_new_session=True,
                    )  # fmt: skip
                except (OSError, ValueError) as error:
                    raise ActionFailed(_reason(error)) from error
            on_sent()
            try:
                status = process.wait(action.timeout)
            except subprocess.TimeoutExpired as error:
                self._kill()
                process.wait()
                raise ActionFailed(f"killed after {action.timeout:g} s") from error
            finally:
                with self._lock:
                    self._process = None
            if status != 0:
                raise ActionFailed(f"exit status {status}{_error_text(errors.fileno())}")

    def stop(self) -> None:
        """Kill the running program and refuse further ones."""
        with self._lock:
            self._stopped = True
        self._kill()

    def _kill(self) -> None:
        with self._lock:
            if self._process is not None and self._process.poll() is None:
                os.killpg(self._process.pid, signal.SIGKILL)


def _error_text(file: int) -> str:
    """The end of a file in one line, preceded by a colon; "" without text."""
    size = os.fstat(file).st_size
    text = " ".join(os.pread(file, MAX_ERROR_BYTES, max(0, size - MAX_ERROR_BYTES)).decode("utf-8", "replace").split())
    return f": {text}" if text else ""


def _reason(error: Exception) -> str:
    text = " ".join((getattr(error, "strerror", None) or str(error)).split())
    return text or type(error).__name__
