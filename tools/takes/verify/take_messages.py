"""Messages of a take for verification, in order over its parts."""

import re
from collections import Counter, OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import SETUP_FILE, RecordedRig, read_setup
from zenocap.common.topics import Queueing

DERIVED = (
    m.Sighting, m.PartialBdp, m.PartialBap, m.Assignment, m.UniversalBdp, m.UniversalBap, m.TrackerBdp, m.TrackerPose,
    m.ScenePoints, m.Posture, m.FrameRate, m.TrackerDetail, m.CameraDelays,
)  # fmt: skip
KEPT_NS = 60_000_000_000  # time after which a message is no input any more and stays unchecked; chosen by hand
Place = tuple[str, int]  # key and capture time


def first_trace_ns(path: Path) -> int:
    """Log time of the first input trace in a file, which orders the parts; 0 when there is none."""
    for received in messages_of(TakeReader(path)):
        if isinstance(received.message, m.Handled):
            return received.received_ns
    return 0


def messages_of(take: TakeReader) -> Iterator[Envelope]:
    """Valid messages of zenocap, without those that a part repeats from the parts before."""
    for number, received in enumerate(take.envelopes(), 1):  # what cannot be decoded cannot be an input of a service
        part = take.metadata.get("part", {})
        repeated = part.get("repeated", "") if part.get("number", "1") != "1" else ""
        if not (re.fullmatch(r"\d{1,9}", repeated) and number <= int(repeated)):  # metadata have no checksum of their own
            yield received


def setup_in(path: Path, take: TakeReader) -> RecordedRig:
    """Setup of the services with which the take was recorded.  Raises UserError."""
    if SETUP_FILE not in take.attachments:
        raise UserError(
            f"{path}: no attachment {SETUP_FILE}: recorded by an older version, or by `zenocap record` without the rig "
            "file; the setup of its services is unknown"
        )
    return read_setup(path, take.attachments[SETUP_FILE])


@dataclass
class Logged:
    """A message of the take.  number: in the order of the log.  checked: a step has published it again."""

    received: Envelope
    number: int
    checked: bool = False


class MessageStore:
    """Messages by key and capture time, for KEPT_NS; those of latched topics to the end.

    unchecked: derived messages that were dropped without having been recomputed, by key.
    """

    def __init__(self) -> None:
        self.unchecked: Counter[str] = Counter()
        self._recent: OrderedDict[Place, Logged] = OrderedDict()
        self._latched: dict[Place, Logged] = {}
        self._number = 0

    def add(self, received: Envelope) -> None:
        """Store a message; it replaces one of the same key and time."""
        self._number += 1
        place = (received.key, received.message.captured_ns)
        if received.topic.queueing is Queueing.LATCHED:
            self._drop(self._latched.pop(place, None))
            self._latched[place] = Logged(received, self._number)
            return
        self._drop(self._recent.pop(place, None))
        self._recent[place] = Logged(received, self._number)
        while next(iter(self._recent.values())).received.received_ns < received.received_ns - KEPT_NS:
            self._drop(self._recent.popitem(last=False)[1])

    def find(self, key: str, captured_ns: int) -> Logged | None:
        return self._recent.get((key, captured_ns)) or self._latched.get((key, captured_ns))

    def message(self, key: str, captured_ns: int) -> m.Message | None:
        logged = self.find(key, captured_ns)
        return logged.received.message if logged else None

    def close(self) -> None:
        """Drop all messages, counting those that were not checked."""
        for logged in (*self._recent.values(), *self._latched.values()):
            self._drop(logged)
        self._recent.clear()
        self._latched.clear()

    def _drop(self, logged: Logged | None) -> None:
        if logged is not None and isinstance(logged.received.message, DERIVED) and not logged.checked:
            self.unchecked[logged.received.key] += 1
