"""Who listens to a replay, and waiting for them when it goes as fast as they keep up."""

import logging

from common.bus.protocol import Alive, Bus
from common.topics import Topic

logger = logging.getLogger(__name__)

PATIENCE_S = 2.0  # longest wait for a service to handle what it got
Name = tuple[str, str]


class Consumers:
    """The live services of the rig that the replay does not stand in for.

    given_up: those that did not answer, and are no longer waited for.
    """

    def __init__(self, bus: Bus, own: frozenset[Name]) -> None:
        self._bus, self._own = bus, own
        self._alive: set[Name] = set()
        self._heeded: dict[str, bool] = {}  # by key, whether any of them listened to it when last asked
        self._sent: set[str] = set()  # keys since they were last waited for
        self._unpaced: dict[str, Topic] = {}  # of those, what somebody may listen to
        self.given_up: set[Name] = set()

    def hear(self) -> None:
        """What came on the bus.  Raises DuplicateService when another process runs what the replay stands in for."""
        while (event := self._bus.receive(0.0)) is not None:
            if isinstance(event, Alive):
                name = (event.service, event.id)
                if event.alive and name not in self._own:
                    self._alive.add(name)
                    self._heeded.clear()
                else:
                    self._alive.discard(name)
                    self.given_up.discard(name)  # whoever comes back gets another chance

    @property
    def names(self) -> frozenset[Name]:
        return frozenset(self._alive)

    def send(self, topic: Topic, key: str) -> None:
        """Before a message: wait where it could supersede one, or be handled before one that was sent earlier."""
        if self._heeded.get(key, True):
            if key in self._unpaced or any(other is not topic for other in self._unpaced.values()):
                self.keep_pace()
            self._unpaced[key] = topic
        self._sent.add(key)

    def keep_pace(self) -> None:
        """Wait until all have handled everything sent; who does not within PATIENCE_S is named, and left behind."""
        self._unpaced.clear()
        waited_for = self._alive - self.given_up
        if not waited_for:
            return
        answers = self._bus.pace(waited_for, PATIENCE_S)
        heeded = frozenset().union(*answers.values())
        self._heeded.update((key, key in heeded) for key in self._sent)
        self._sent.clear()
        slow = waited_for - answers.keys()
        self.hear()
        for service, id in sorted(slow & self._alive):
            self.given_up.add((service, id))
            logger.warning(
                "%s %s did not handle its messages within %g s: not waited for any more", service, id, PATIENCE_S
            )
