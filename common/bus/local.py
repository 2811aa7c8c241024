"""A bus inside one process, without threads or waiting: the same bytes, checks and queues as on the network.

Everything is delivered in the order of `publish`, so that two runs that publish and receive alike are alike.
"""

import logging
import re
from collections.abc import Collection
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

from common.bus.inbox import Inbox, check_key, outgoing
from common.bus.protocol import Alive, Counters, DuplicateService, Received, RoundTrip
from common.messages import Message
from common.runtime.clock import Clock
from common.topics import Queueing, Topic, checked_name

logger = logging.getLogger(__name__)


@dataclass
class LocalNetwork:
    """What the buses of one rig share: `network.bus()` for each participant."""

    rig: str
    clock: Clock
    buses: list["LocalBus"] = field(default_factory=list)
    kept: dict[str, tuple[Topic, bytes]] = field(default_factory=dict)
    alive: dict[tuple[str, str], "LocalBus"] = field(default_factory=dict)
    timekeeper: Clock | None = None

    def __post_init__(self) -> None:
        checked_name("rig", self.rig)

    def bus(self, clock: Clock | None = None) -> "LocalBus":
        """A new participant; clock: its own, if it is to differ from the network's."""
        bus = LocalBus(self, clock or self.clock)
        self.buses.append(bus)
        return bus

    def tell_alive(self, service: str, id: str, alive: bool) -> None:
        for bus in self.buses:
            bus.hear_alive(service, id, alive)


@dataclass(frozen=True)
class _Subscription:
    topic: Topic
    key: re.Pattern[str]
    every: bool


class LocalBus:
    """One participant of a `LocalNetwork`; see `common.bus.protocol.Bus`."""

    def __init__(self, network: LocalNetwork, clock: Clock) -> None:
        self._network = network
        self._clock = clock
        self._inbox = Inbox(logger)
        self._subscriptions: list[_Subscription] = []
        self._watching = False
        self._sent: set[str] = set()

    @property
    def rig(self) -> str:
        return self._network.rig

    @property
    def counters(self) -> Counters:
        return self._inbox.counters

    def publish(self, topic: Topic, message: Message, **names: str) -> None:
        key, data = outgoing(self.rig, topic, message, names)
        self._send(topic, key, data)

    def announce(self, topic: Topic, key: str) -> None:
        check_key(self.rig, topic, key)

    def forward(self, topic: Topic, key: str, data: bytes) -> None:
        check_key(self.rig, topic, key)
        self._send(topic, key, data)

    def _send(self, topic: Topic, key: str, data: bytes) -> None:
        if topic.queueing is Queueing.KEPT:
            self._network.kept[key] = (topic, data)
        self._sent.add(key)
        for bus in self._network.buses:
            bus.hear(key, data)

    def subscribe(self, topic: Topic, *, every: bool = False, **names: str) -> None:
        pattern = re.compile(re.escape(topic.on(self.rig, **names)).replace(r"\*", "[^/]+"))
        subscription = _Subscription(topic, pattern, every)
        self._subscriptions.append(subscription)
        for key, (kept_topic, data) in self._network.kept.items():
            if kept_topic is topic:
                self._hear_as(subscription, key, data)

    def hear(self, key: str, data: bytes) -> None:
        """Bytes from the network, valid or not."""
        for subscription in self._subscriptions:
            self._hear_as(subscription, key, data)

    def _hear_as(self, subscription: _Subscription, key: str, data: bytes) -> None:
        if subscription.key.fullmatch(key):
            self._inbox.put(key, subscription.topic, data, self._clock.now_ns(), every=subscription.every)

    def hear_alive(self, service: str, id: str, alive: bool) -> None:
        if self._watching:
            self._inbox.put_event(Alive(service, id, alive, self._clock.now_ns()))

    def watch_alive(self) -> None:
        self._watching = True
        for service, id in self._network.alive:
            self.hear_alive(service, id, True)

    def declare_alive(self, service: str, id: str) -> None:
        name = (checked_name("service", service), checked_name("id", id))
        if name in self._network.alive:
            raise DuplicateService(self.rig, service, id)
        self._network.alive[name] = self
        self._network.tell_alive(service, id, True)

    def pace(self, services: Collection[tuple[str, str]], timeout_s: float) -> dict[tuple[str, str], frozenset[str]]:
        """Those that have handled everything; never waits, for nothing is handled while it would."""
        sent, self._sent = self._sent, set()
        buses = {name: bus for name in services if (bus := self._network.alive.get(name)) is not None}
        return {name: frozenset(filter(bus.listens, sent)) for name, bus in buses.items() if bus.idle}

    @property
    def idle(self) -> bool:
        """Nothing waits to be received."""
        return self._inbox.empty

    def listens(self, key: str) -> bool:
        """Whether a subscription fits `key`."""
        return any(subscription.key.fullmatch(key) for subscription in self._subscriptions)

    def serve_clock(self) -> None:
        self._network.timekeeper = self._clock

    def ask_clock(self) -> None:
        if self._network.timekeeper:
            sent_ns, answered_ns = self._clock.now_ns(), self._network.timekeeper.now_ns()
            self._inbox.put_event(RoundTrip(sent_ns, answered_ns, self._clock.now_ns()))

    def recall(self, topic: Topic) -> None:
        """Does nothing: inside one process nobody outlives another."""

    def receive(self, timeout_s: float = 0.0) -> Received | None:
        """The next event or None; never waits, for nothing can come while it would."""
        return self._inbox.take(0.0)

    def wake(self) -> None:
        """Does nothing: `receive` never waits."""

    def reader(self) -> "LocalBus":
        return self._network.bus(self._clock)

    def close(self) -> None:
        if self in self._network.buses:
            self._network.buses.remove(self)
        self._subscriptions.clear()
        for service, id in [name for name, bus in self._network.alive.items() if bus is self]:
            del self._network.alive[(service, id)]
            self._network.tell_alive(service, id, False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()
