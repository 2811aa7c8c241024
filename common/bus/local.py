"""Bus within one process, without threads; encoding, checks and queues as on the network.

Messages are delivered in the order of `publish`: equal sequences of calls give equal results.
"""

import logging
import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field, replace

from zenocap.common.bus.inbox import Inbox, check_key, counts_as_sent, outgoing
from zenocap.common.bus.protocol import Alive, Counters, DuplicateService, Received, RoundTrip
from zenocap.common.closable import Closable
from zenocap.common.messages import Message
from zenocap.common.runtime.clock import Clock
from zenocap.common.topics import Queueing, Topic, checked_name

logger = logging.getLogger(__name__)


@dataclass
class LocalNetwork:
    """Connection of the in-process buses of one rig; `bus()` adds a participant."""

    rig: str
    clock: Clock
    buses: list["LocalBus"] = field(default_factory=list)
    kept: dict[str, tuple[Topic, bytes]] = field(default_factory=dict)
    alive: dict[tuple[str, str], "LocalBus"] = field(default_factory=dict)
    timekeeper: Clock | None = None

    def __post_init__(self) -> None:
        checked_name("rig", self.rig)

    def bus(self, clock: Clock | None = None) -> "LocalBus":
        """A new participant.  clock: its own clock; default: the network's."""
        bus = LocalBus(self, clock or self.clock)
        self.buses.append(bus)
        return bus

    def notify_alive(self, service: str, id: str, alive: bool) -> None:
        for bus in self.buses:
            bus.put_alive(service, id, alive)


@dataclass(frozen=True)
class _Subscription:
    topic: Topic
    key: re.Pattern[str]
    every: bool


class LocalBus(Closable):
    """One participant of a `LocalNetwork`; see `zenocap.common.bus.protocol.Bus`."""

    def __init__(self, network: LocalNetwork, clock: Clock) -> None:
        self._network = network
        self._clock = clock
        self._inbox = Inbox(logger)
        self._subscriptions: list[_Subscription] = []
        self._watches_alive = False
        self._sent: set[str] = set()
        self._sent_in_all: Counter[str] = Counter()  # by name of the topic

    @property
    def rig(self) -> str:
        return self._network.rig

    @property
    def counters(self) -> Counters:
        return replace(self._inbox.counters, sent=dict(self._sent_in_all))

    def publish(self, topic: Topic, message: Message, **names: str) -> None:
        key, data = outgoing(self.rig, topic, message, names)
        self._send(topic, key, data)

    def announce(self, topic: Topic, key: str) -> None:
        check_key(self.rig, topic, key)

    def forward(self, topic: Topic, key: str, data: bytes) -> None:
        check_key(self.rig, topic, key)
        self._send(topic, key, data)

    def _send(self, topic: Topic, key: str, data: bytes) -> None:
        if topic.queueing is Queueing.LATCHED:
            self._network.kept[key] = (topic, data)
        self._sent.add(key)
        if counts_as_sent(topic):
            self._sent_in_all[topic.name] += 1
        for bus in self._network.buses:
            bus.deliver(key, data)

    def subscribe(self, topic: Topic, *, every: bool = False, **names: str) -> None:
        pattern = re.compile(re.escape(topic.on(self.rig, **names)).replace(r"\*", "[^/]+"))
        subscription = _Subscription(topic, pattern, every)
        self._subscriptions.append(subscription)
        for key, (kept_topic, data) in self._network.kept.items():
            if kept_topic is topic:
                self._deliver_to(subscription, key, data)

    def deliver(self, key: str, data: bytes) -> None:
        """Queue bytes from the network, valid or not."""
        for subscription in self._subscriptions:
            self._deliver_to(subscription, key, data)

    def _deliver_to(self, subscription: _Subscription, key: str, data: bytes) -> None:
        if subscription.key.fullmatch(key):
            self._inbox.put(key, subscription.topic, data, self._clock.now_ns(), every=subscription.every)

    def put_alive(self, service: str, id: str, alive: bool) -> None:
        if self._watches_alive:
            self._inbox.put_event(Alive(service, id, alive, self._clock.now_ns()))

    def watch_alive(self) -> None:
        self._watches_alive = True
        for service, id in self._network.alive:
            self.put_alive(service, id, True)

    def declare_alive(self, service: str, id: str) -> None:
        name = (checked_name("service", service), checked_name("id", id))
        if name in self._network.alive:
            raise DuplicateService(self.rig, service, id)
        self._network.alive[name] = self
        self._network.notify_alive(service, id, True)

    def wait_until_handled(
        self, services: Collection[tuple[str, str]], timeout_s: float
    ) -> dict[tuple[str, str], frozenset[str]]:
        """The services that have handled everything; never waits, because nothing is handled meanwhile."""
        sent, self._sent = self._sent, set()
        buses = {name: bus for name in services if (bus := self._network.alive.get(name)) is not None}
        return {name: frozenset(filter(bus.listens, sent)) for name, bus in buses.items() if bus.idle}

    @property
    def idle(self) -> bool:
        """Whether the queue is empty."""
        return self._inbox.empty

    def listens(self, key: str) -> bool:
        """Whether a subscription matches `key`."""
        return any(subscription.key.fullmatch(key) for subscription in self._subscriptions)

    def serve_clock(self) -> None:
        self._network.timekeeper = self._clock

    def query_clock(self) -> None:
        if self._network.timekeeper:
            sent_ns, answered_ns = self._clock.now_ns(), self._network.timekeeper.now_ns()
            self._inbox.put_event(RoundTrip(sent_ns, answered_ns, self._clock.now_ns()))

    def request_recovery(self, topic: Topic) -> None:
        """Does nothing: in one process no reader survives a restarted service."""

    def receive(self, timeout_s: float = 0.0) -> Received | None:
        """The next event or None; never waits, because nothing can arrive meanwhile."""
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
            self._network.notify_alive(service, id, False)
