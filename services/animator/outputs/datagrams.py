"""Datagrams to one receiver, which may come and go: sending never waits, and says once when nobody listens."""

import logging
import socket
from collections import Counter

from services.animator.outputs.output import OutputError

logger = logging.getLogger(__name__)

QUIET_AFTER = 300  # datagrams without a failure, after which a new one is worth a line again


class Datagrams:
    """title: the key in the rig and the address, for what is logged.

    counts: datagrams `sent`; `unheard`, to which the receiver's machine said that nobody listens (only some say so);
    `dropped`, for which the system had no room; `failed`.
    """

    def __init__(self, key: str, host: str, port: int) -> None:
        """The name is looked up here, once.  Raises OutputError."""
        self.title = f"{key} {host}:{port}"
        self.counts = Counter[str]()
        self._quiet = QUIET_AFTER
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
        except (OSError, UnicodeError) as error:
            raise OutputError(f"{key}.host = {host!r}: not an address that is known here: {_why(error)}") from error
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self._socket.connect(address)  # so that the system tells when nobody listens
        except OSError as error:
            self._socket.close()
            raise OutputError(f"{key}.host = {host!r}: cannot be sent to: {_why(error)}") from error

    def send(self, data: bytes) -> None:
        """One datagram."""
        try:
            try:
                self._socket.send(data)
            except ConnectionRefusedError:  # that was the one before, and this one is not on its way yet
                self.counts["unheard"] += 1
                self._say("nobody listens there; sending goes on")
                self._socket.send(data)
        except BlockingIOError:
            self.counts["dropped"] += 1
        except OSError as error:
            self.counts["failed"] += 1
            self._say(f"cannot be sent to: {_why(error)}; sending goes on")
        else:
            self.counts["sent"] += 1
            self._quiet += 1

    def close(self) -> None:
        self._socket.close()

    def _say(self, what: str) -> None:
        if self._quiet >= QUIET_AFTER:
            logger.warning("%s: %s", self.title, what)
        self._quiet = 0


def _why(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
