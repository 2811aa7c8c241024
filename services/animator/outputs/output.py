"""Interface of outputs, which forward every pose and never block, and their shared UDP sender."""

import logging
import socket
from collections import Counter
from collections.abc import Mapping
from typing import Protocol

from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.services.animator.parameters import QUIET_DATAGRAMS
from zenocap.services.animator.states import ActorPose

logger = logging.getLogger(__name__)


class OutputError(UserError):
    """An output that cannot be opened; the text names its key in the rig file, the value, and the reason."""


class Output(Protocol):
    """All methods are called from one thread; none blocks, and none raises once the output is open."""

    @property
    def title(self) -> str:
        """Key in the rig file and destination, such as "animator.vmc 127.0.0.1:39539"."""
        ...

    def receive(self, envelope: Envelope) -> None:
        """Handle a message of the rig; called before `send` with the actor derived from it."""
        ...

    def send(self, actor: ActorPose, posture: str | None) -> None:
        """Send a new pose, or that the person is lost.  posture: the recognized one, None for none."""
        ...

    def counts(self) -> Mapping[str, int]:
        """Counters since the output was opened."""
        ...

    def close(self) -> None: ...


class DatagramSender:
    """UDP datagrams to one receiver, which may start and stop at any time.

    title: key in the rig file and address, for log lines.
    counts: datagrams `sent`; `refused`: by the receiver's machine, because no program listens (not every machine
    reports this); `dropped`: the system's send buffer is full; `failed`: other errors.
    """

    def __init__(self, key: str, host: str, port: int) -> None:
        """Resolves the host name once.  Raises OutputError."""
        self.title = f"{key} {host}:{port}"
        self.counts = Counter[str]()
        self._since_failure = QUIET_DATAGRAMS
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
        except (OSError, UnicodeError) as error:
            raise OutputError(f"{key}.host = {host!r}: the address cannot be resolved: {_reason(error)}") from error
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self._socket.connect(address)  # a connected socket reports ICMP "port unreachable"
        except OSError as error:
            self._socket.close()
            raise OutputError(f"{key}.host = {host!r}: cannot be sent to: {_reason(error)}") from error

    def send(self, data: bytes) -> None:
        """Send one datagram, or count why it was not sent."""
        try:
            try:
                self._socket.send(data)
            except ConnectionRefusedError:  # reports the previous datagram; this one has not been sent
                self.counts["refused"] += 1
                self._warn("no program listens at this address; sending continues")
                self._socket.send(data)
        except BlockingIOError:
            self.counts["dropped"] += 1
        except OSError as error:
            self.counts["failed"] += 1
            self._warn(f"cannot be sent to: {_reason(error)}; sending continues")
        else:
            self.counts["sent"] += 1
            self._since_failure += 1

    def close(self) -> None:
        self._socket.close()

    def _warn(self, text: str) -> None:
        if self._since_failure >= QUIET_DATAGRAMS:
            logger.warning("%s: %s", self.title, text)
        self._since_failure = 0


class DatagramOutput:
    """An output that sends datagrams to one receiver: all but its `send`."""

    def __init__(self, key: str, host: str, port: int) -> None:
        """Raises OutputError."""
        self._sender = DatagramSender(key, host, port)

    @property
    def title(self) -> str:
        return self._sender.title

    def receive(self, envelope: Envelope) -> None:
        pass

    def counts(self) -> Mapping[str, int]:
        return self._sender.counts

    def close(self) -> None:
        self._sender.close()


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
