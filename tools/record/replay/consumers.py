"""Live services that receive a replay, and flow control for them at rate 0."""

import logging

from zenocap.common.bus.protocol import Alive, Bus
from zenocap.common.topics import Topic

logger = logging.getLogger(__name__)

ANSWER_TIMEOUT_S = 2.0  # longest wait for a service to handle its messages
Name = tuple[str, str]


class Consumers:
    """The live services of the rig that the replay does not act as.

    given_up: services that did not answer in time and are no longer waited for.
    """

    def __init__(self, bus: Bus, own: frozenset[Name]) -> None:
        self._bus, self._own = bus, own
        self._alive: set[Name] = set()
        self._subscribed: dict[str, bool] = {}  # by key, whether any of them subscribed to it at the last query
        self._sent: set[str] = set()  # keys since the last wait
        self._unpaced: dict[str, Topic] = {}  # of those, the ones with a subscriber
        self.given_up: set[Name] = set()

    def poll(self) -> None:
        """Handle events of the bus.  Raises DuplicateService when a service of the take is running."""
        while (event := self._bus.receive(0.0)) is not None:
            if isinstance(event, Alive):
                name = (event.service, event.id)
                if event.alive and name not in self._own:
                    self._alive.add(name)
                    self._subscribed.clear()
                else:
                    self._alive.discard(name)
                    self.given_up.discard(name)  # a service that returns is waited for again

    @property
    def names(self) -> frozenset[Name]:
        return frozenset(self._alive)

    def send(self, topic: Topic, key: str) -> None:
        """Before a message: wait where it could replace an earlier one, or be handled before it."""
        if self._subscribed.get(key, True):
            if key in self._unpaced or any(other is not topic for other in self._unpaced.values()):
                self.keep_pace()
            self._unpaced[key] = topic
        self._sent.add(key)

    def keep_pace(self) -> None:
        """Wait until all messages are handled; services that exceed ANSWER_TIMEOUT_S are logged and given up."""
        self._unpaced.clear()
        expected = self._alive - self.given_up
        if not expected:
            return
        answers = self._bus.wait_until_handled(expected, ANSWER_TIMEOUT_S)
        subscribed = frozenset().union(*answers.values())
        self._subscribed.update((key, key in subscribed) for key in self._sent)
        self._sent.clear()
        overdue = expected - answers.keys()
        self.poll()
        for service, id in sorted(overdue & self._alive):
            self.given_up.add((service, id))
            logger.warning(
                "%s %s did not handle its messages within %g s: no longer waited for", service, id, ANSWER_TIMEOUT_S
            )
