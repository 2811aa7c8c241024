"""The messages of a take while they may still be needed: as input of a step, or to be compared with what a step said."""

from collections import Counter, OrderedDict
from dataclasses import dataclass

from common import messages as m
from common.bus.protocol import Envelope
from common.topics import Queueing

DERIVED = (
    m.Sighting, m.PartialBdp, m.PartialBap, m.Assignment, m.UniversalBdp, m.UniversalBap, m.TrackerBdp, m.TrackerPose,
    m.ScenePoints, m.Posture,
)  # fmt: skip
FORGET_NS = 60_000_000_000  # what nobody was fed for so long is checked by nobody
Place = tuple[str, int]  # key and capture time


@dataclass
class Logged:
    """number: in the order of the log.  checked: a step has said it again."""

    received: Envelope
    number: int
    checked: bool = False


class Memory:
    """By key and capture time, for FORGET_NS; what is kept for late joiners, for ever.  unchecked: derived ones, by key."""

    def __init__(self) -> None:
        self.unchecked: Counter[str] = Counter()
        self._passing: OrderedDict[Place, Logged] = OrderedDict()
        self._kept: dict[Place, Logged] = {}
        self._number = 0

    def keep(self, received: Envelope) -> None:
        """Remember a message, in the place of one of the same key and time."""
        self._number += 1
        place = (received.key, received.message.captured_ns)
        if received.topic.queueing is Queueing.KEPT:
            self._count(self._kept.pop(place, None))
            self._kept[place] = Logged(received, self._number)
            return
        self._count(self._passing.pop(place, None))
        self._passing[place] = Logged(received, self._number)
        while next(iter(self._passing.values())).received.received_ns < received.received_ns - FORGET_NS:
            self._count(self._passing.popitem(last=False)[1])

    def find(self, key: str, captured_ns: int) -> Logged | None:
        return self._passing.get((key, captured_ns)) or self._kept.get((key, captured_ns))

    def message(self, key: str, captured_ns: int) -> m.Message | None:
        logged = self.find(key, captured_ns)
        return logged.received.message if logged else None

    def end(self) -> None:
        """Nothing more is going to be checked."""
        for logged in (*self._passing.values(), *self._kept.values()):
            self._count(logged)
        self._passing.clear()
        self._kept.clear()

    def _count(self, logged: Logged | None) -> None:
        if logged is not None and isinstance(logged.received.message, DERIVED) and not logged.checked:
            self.unchecked[logged.received.key] += 1
