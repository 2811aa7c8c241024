"""Who listens to a replay, and waiting for them when it goes as fast as they keep up."""

import logging

from common.bus.protocol import Alive, Bus

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
        self.given_up: set[Name] = set()

    def hear(self) -> None:
        """What came on the bus.  Raises DuplicateService when another process runs what the replay stands in for."""
        while (event := self._bus.receive(0.0)) is not None:
            if isinstance(event, Alive):
                name = (event.service, event.id)
                if event.alive and name not in self._own:
                    self._alive.add(name)
                else:
                    self._alive.discard(name)
                    self.given_up.discard(name)  # whoever comes back gets another chance

    @property
    def names(self) -> frozenset[Name]:
        return frozenset(self._alive)

    def keep_pace(self) -> None:
        """Wait until all have handled everything sent; who does not within PATIENCE_S is named, and left behind."""
        waited_for = self._alive - self.given_up
        if not waited_for:
            return
        slow = waited_for - self._bus.pace(waited_for, PATIENCE_S)
        self.hear()
        for service, id in sorted(slow & self._alive):
            self.given_up.add((service, id))
            logger.warning(
                "%s %s did not handle its messages within %g s: not waited for any more", service, id, PATIENCE_S
            )
