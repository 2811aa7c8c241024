"""What every bus can do, what comes out of it, and what else a step is fed: ticks and frames.

One thread owns a bus: it publishes, and it receives what the transport's own threads have only queued.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol, Self

from common.messages import Message
from common.topics import Topic


@dataclass(frozen=True)
class Envelope:
    """A valid message and how it came.

    received_ns: when it was queued here, this machine's clock.  data: its bytes as they came; empty when made by hand.
    """

    key: str
    topic: Topic
    message: Message
    received_ns: int
    data: bytes = field(default=b"", repr=False, compare=False)


@dataclass(frozen=True)
class Alive:
    """A service of the rig came (alive) or went."""

    service: str
    id: str
    alive: bool
    received_ns: int


@dataclass(frozen=True)
class Tick:
    """Time passed: lets a step notice what did not come."""

    received_ns: int


class FrameLike(Protocol):
    """frame: number from 0.  captured_ns: capture time, nanoseconds since the Unix epoch, this machine's clock."""

    @property
    def frame(self) -> int: ...

    @property
    def captured_ns(self) -> int: ...


@dataclass(frozen=True)
class RoundTrip:
    """One exchange with the integrator's clock: sent and received by this clock, answered by the integrator's."""

    sent_ns: int
    answered_ns: int
    received_ns: int


Received = Envelope | Alive | RoundTrip


@dataclass(frozen=True)
class Counters:
    """Since the bus was opened.

    rejected: by what was wrong ("invalid", "names", "size").  dropped: by which limit ("superseded", "queue_full",
    "too_many_keys"); a LATEST topic supersedes by design.
    """

    received: int
    rejected: Mapping[str, int]
    dropped: Mapping[str, int]


class BusError(Exception):
    """The bus cannot be opened or used; the text is for the person who started the program."""


class DuplicateService(BusError):
    """Another process runs this service of this rig."""

    def __init__(self, rig: str, service: str, id: str) -> None:
        super().__init__(f"{service} {id} of rig {rig} is already running; stop it, or choose another id")


class Bus(Protocol):
    """Typed publish and subscribe for one rig."""

    @property
    def rig(self) -> str: ...

    def publish(self, topic: Topic, message: Message, **names: str) -> None:
        """Send `message`; names left out are taken from the message.  Never waits for readers.

        Raises BadMessage for values out of range and ValueError when a name is missing or disagrees with the message.
        """

    def announce(self, topic: Topic, key: str) -> None:
        """Make ready to send on a key of this rig and topic, so that the network knows of it before the first message.

        Raises ValueError for another key.
        """

    def forward(self, topic: Topic, key: str, data: bytes) -> None:
        """Send bytes that were encoded and checked before, on a key of this rig and topic; else as `publish`.

        Raises ValueError for another key.
        """

    def subscribe(self, topic: Topic, *, every: bool = False, **names: str) -> None:
        """Receive a topic from all whose names match.  every: queue each message, also of LATEST topics."""

    def watch_alive(self) -> None:
        """Receive `Alive` for every service of the rig, those already there included."""

    def declare_alive(self, service: str, id: str) -> None:
        """Be seen as this service until closed.  Raises DuplicateService, here or later in `receive`."""

    def pace(self, services: Collection[tuple[str, str]], timeout_s: float) -> dict[tuple[str, str], frozenset[str]]:
        """Wait until these services, by name and id, have handled everything that this bus has sent.

        Returns those that have, with the keys they listen to of those sent since the last time.  The others took longer
        than `timeout_s`, or cannot tell.
        """

    def serve_clock(self) -> None:
        """Answer round trips with this bus's clock: the integrator only."""

    def ask_clock(self) -> None:
        """Start a round trip to the integrator's clock; a `RoundTrip` is received if it answers."""

    def recall(self, topic: Topic) -> None:
        """Ask those who read it what was last said on a `recalled` topic without names; the answer is received like it."""

    def receive(self, timeout_s: float) -> Received | None:
        """The next event, or None after `timeout_s` or when woken.  Raises DuplicateService."""

    def wake(self) -> None:
        """Let `receive` return at once; the only method for other threads."""

    def reader(self) -> "Bus":
        """A second reader on the same connection, with its own subscriptions, queue and thread."""

    @property
    def counters(self) -> Counters: ...

    def close(self) -> None:
        """Let go of everything; what is still queued can be received."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
