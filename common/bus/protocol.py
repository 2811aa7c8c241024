"""The bus protocol, the events received from a bus, and the other inputs of a step: ticks and frames.

One thread owns a bus: it publishes, and it receives the events that the threads of the transport have queued.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Protocol, Self

from zenocap.common.errors import UserError
from zenocap.common.messages import Message
from zenocap.common.topics import Topic


@dataclass(frozen=True)
class Envelope:
    """A valid message with its topic, key and time of receipt.

    received_ns: time of queueing, this machine's clock.  data: its bytes as received; empty when it was not received.
    """

    key: str
    topic: Topic
    message: Message
    received_ns: int
    data: bytes = field(default=b"", repr=False, compare=False)


@dataclass(frozen=True)
class Alive:
    """A service of the rig appeared (alive) or disappeared."""

    service: str
    id: str
    alive: bool
    received_ns: int


@dataclass(frozen=True)
class Tick:
    """Time step without a message, with which a step detects missing inputs."""

    received_ns: int


class FrameLike(Protocol):
    """frame: number from 0.  captured_ns: capture time, nanoseconds since the Unix epoch, this machine's clock."""

    @property
    def frame(self) -> int: ...

    @property
    def captured_ns(self) -> int: ...


@dataclass(frozen=True)
class RoundTrip:
    """One query of the integrator's clock: sent and received by this clock, answered by the integrator's."""

    sent_ns: int
    answered_ns: int
    received_ns: int

    @property
    def ahead_ns(self) -> int:
        """The integrator's clock minus this one, to half the time of the trip."""
        return self.answered_ns - (self.sent_ns + self.received_ns) // 2


Received = Envelope | Alive | RoundTrip


@dataclass(frozen=True)
class Counters:
    """Counts since the bus was opened.

    rejected: by reason ("invalid", "version", "names", "size").  dropped: by limit ("superseded", "queue_full",
    "too_many_keys"); superseded messages of LATEST topics are normal.  queued: messages and events that wait.
    certificate_days: whole days until the own certificate expires, None for a rig without certificates.
    sent: messages published on keys of services, by name of the topic, without those of LATCHED topics.
    """

    received: int
    rejected: Mapping[str, int]
    dropped: Mapping[str, int]
    queued: int = 0
    certificate_days: int | None = None
    sent: Mapping[str, int] = field(default_factory=dict)


class BusError(UserError):
    """The bus cannot be opened or used; the text is for the user."""


class DuplicateService(BusError):
    """Another process already runs this service of this rig."""

    def __init__(self, rig: str, service: str, id: str) -> None:
        super().__init__(f"{service} {id} of rig {rig} is already running; stop it, or choose another id")


class Bus(Protocol):
    """Typed publish and subscribe for one rig."""

    @property
    def rig(self) -> str: ...

    def publish(self, topic: Topic, message: Message, **names: str) -> None:
        """Send `message`; missing `names` are taken from the message.  Never waits for readers.

        Raises BadMessage for values out of range and ValueError when a name is missing or disagrees with the message.
        """

    def announce(self, topic: Topic, key: str) -> None:
        """Declare a key of this rig and topic on the network before its first message.

        Raises ValueError for another key.
        """

    def forward(self, topic: Topic, key: str, data: bytes) -> None:
        """Send bytes that are already encoded and checked, on a key of this rig and topic; otherwise as `publish`.

        Raises ValueError for another key.
        """

    def subscribe(self, topic: Topic, *, every: bool = False, **names: str) -> None:
        """Receive a topic from all publishers whose names match.  every: queue each message, also of LATEST topics."""

    def watch_alive(self) -> None:
        """Receive `Alive` for every service of the rig, including those already running."""

    def declare_alive(self, service: str, id: str) -> None:
        """Declare liveliness as this service until `close`.  Raises DuplicateService, here or later in `receive`."""

    def wait_until_handled(
        self, services: Collection[tuple[str, str]], timeout_s: float
    ) -> dict[tuple[str, str], frozenset[str]]:
        """Wait until these services, by name and id, have handled everything that this bus has sent.

        Returns those that have, with the keys they subscribe to among those sent since the last call.  The others took
        longer than `timeout_s` or do not support the query.
        """

    def serve_clock(self) -> None:
        """Answer clock queries with this bus's clock; only for the integrator."""

    def query_clock(self) -> None:
        """Query the integrator's clock; a `RoundTrip` is received when the reply arrives."""

    def request_recovery(self, topic: Topic) -> None:
        """Request the last message of a `recoverable` topic without names from its readers; the reply is received as if
        published."""

    def receive(self, timeout_s: float) -> Received | None:
        """The next event, or None after `timeout_s` or a `wake`.  Raises DuplicateService."""

    def wake(self) -> None:
        """Make `receive` return immediately; the only method that other threads may call."""

    def reader(self) -> "Bus":
        """A second reader on the same connection, with its own subscriptions, queue and thread."""

    @property
    def counters(self) -> Counters: ...

    def close(self) -> None:
        """Close connection and subscriptions; events still queued can be received."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...
