"""Recomputing a take: every service is fed again, in its own order, what the take says that it was fed.

Inputs are the logged messages, and for a viewer's frames the logged silhouettes.  What the steps then say must be, byte
for byte, what the take has.  A service can be followed from its start on, as long as nothing that it was fed is missing.
"""

from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from common import codec
from common.bus.protocol import Alive, Envelope, Tick
from common.messages import Handled, Message, Sighting, Silhouette
from common.runtime.handled import ALIVE, FRAME, GONE, TICK
from common.take.reading import Take, TakeError
from common.take.setup import SETUP_FILE, RecordedRig
from common.topics import SIGHTING, SILHOUETTE, service_at, topic_of
from common.vision.packing import unpack
from services.takes.verify.difference import Difference, difference
from services.takes.verify.memory import DERIVED, Memory
from services.takes.verify.parts import begins_ns, ours, setup_in
from services.takes.verify.services import Event, Name, Repeatable, services_of
from services.viewer.frame import Masked

LATE_NS = 2_000_000_000  # what was said is in the log this long after it was handled, at the latest


@dataclass
class Verified:
    """Derived messages by key.  equal, different: from the recomputed ones.  unlogged: recomputed, but not in the take.

    unchecked: in the take, but not recomputed; reasons say why.  close: of those equal, within the tolerance only.
    first: in the order of the log, the first difference.  duration_s: of the take.
    """

    equal: Counter[str] = field(default_factory=Counter)
    different: Counter[str] = field(default_factory=Counter)
    unlogged: Counter[str] = field(default_factory=Counter)
    unchecked: Counter[str] = field(default_factory=Counter)
    reasons: list[str] = field(default_factory=list)
    close: int = 0
    first: Difference | None = None
    duration_s: float = 0.0
    versions: dict[str, str] = field(default_factory=dict)

    @property
    def checked(self) -> int:
        return self.equal.total() + self.different.total()


@dataclass
class _Followed:
    """A service being followed.  next: number of the event that comes next, None when it cannot be followed."""

    service: Repeatable
    next: int | None = None


class Lost(Exception):
    """A service cannot be followed any further; the text says why."""


def verify(paths: Sequence[Path], tolerance: float = 0.0, watch: Callable[[int], None] = lambda _: None) -> Verified:
    """One take, or the parts of one in any order.  watch: sees the number of messages read, now and then.

    tolerance: by which numbers may differ.  Raises TakeError for a file that is no take or does not say its setup.
    """
    check: _Check | None = None
    count = 0
    for path in sorted(paths, key=begins_ns) if len(paths) > 1 else paths:
        take = Take(path)
        for received in ours(take):
            if check is None:
                check = _Check(path, setup_in(path, take), take.attachments, tolerance)
                check.found.versions = take.metadata.get("versions", {})
            check.see(received)
            count += 1
            if count % 256 == 0:
                watch(count)
        if take.cut and check is not None:
            check.found.reasons.append(take.cut)
    if check is None:
        raise TakeError(f"{paths[0]}: no message of zenocap in it: there is nothing to verify")
    check.end()
    if not check.found.checked:
        why = "; ".join(check.found.reasons) or "no service says what it was fed"
        raise TakeError(f"{paths[0]}: nothing can be verified: {why}")
    return check.found


class _Check:
    """One pass over a take, bounded in memory."""

    def __init__(self, path: Path, rig: RecordedRig, attached: Mapping[str, bytes], tolerance: float) -> None:
        self.found = Verified()
        self._rig, self._tolerance = rig, tolerance
        try:
            self._services = {name: _Followed(service) for name, service in services_of(rig, path, attached).items()}
        except ValueError as error:
            raise TakeError(f"{path}: attachment {SETUP_FILE}: {error}") from error
        self._silent = {viewer.id for viewer in rig.viewers if not viewer.silhouette}
        self._memory = Memory()
        self._waiting: deque[Envelope] = deque()
        self._heard: set[Name] = set()  # who has said what it was fed
        self._start_ns: int | None = None
        self._first: int | None = None  # number of the first message that differs

    def see(self, received: Envelope) -> None:
        """The next message of the take."""
        now_ns = received.received_ns
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        self.found.duration_s = max(self.found.duration_s, (now_ns - self._start_ns) / 1e9)
        if isinstance(received.message, Handled):
            self._waiting.append(received)
        else:
            self._memory.keep(received)
        while self._waiting and self._waiting[0].received_ns < now_ns - LATE_NS:
            self._follow(self._waiting.popleft().message)

    def end(self) -> None:
        while self._waiting:
            self._follow(self._waiting.popleft().message)
        self._memory.end()
        self.found.unchecked = self._memory.unchecked
        silent = {service_at(key) for key in self.found.unchecked} - self._heard
        for name in sorted(name for name in silent if name is not None):
            self._tell(name, "the take does not have what it was fed")
        if self.found.checked and self.found.unchecked and not self.found.reasons:
            self.found.reasons.append("what was said after the last account of what was handled")

    def _follow(self, message: Message) -> None:
        """Feed a service again what it was fed since its last account."""
        assert isinstance(message, Handled)
        name = (message.service, message.id)
        self._heard.add(name)
        followed = self._services.get(name)
        if followed is None:
            if name[0] == "recognizer" and not self._told(name):
                self._tell(name, "the take does not have the model that it was made with")
            return
        if message.first == 0:
            followed.service.begin()
        elif followed.next != message.first:
            if followed.next is not None or message.frame == 0 or not self._told(name):
                self._tell(name, f"what it was fed before event {message.first} is not in the take")
            followed.next = None
            return
        followed.next = message.first + len(message.events)
        try:
            for index, time_ns in message.events:
                what = message.keys[index] if index < len(message.keys) else f"key {index}"
                self._feed(name, followed.service, self._event(name, followed.service, what, time_ns))
        except Lost as lost:
            followed.next = None
            self._tell(name, str(lost))

    def _told(self, name: Name) -> bool:
        return any(reason.startswith(f"{name[0]} {name[1]}: ") for reason in self.found.reasons)

    def _tell(self, name: Name, why: str) -> None:
        self.found.reasons.append(f"{name[0]} {name[1]}: {why}")

    def _event(self, name: Name, service: Repeatable, what: str, time_ns: int) -> Event:
        """Raises Lost."""
        kind, _, whom = what.partition("/")
        if what == TICK:
            return Tick(time_ns)
        if kind in (ALIVE, GONE) and whom.count("/") == 1:
            service_name, _, id = whom.partition("/")
            return Alive(service_name, id, kind == ALIVE, time_ns)
        if what == FRAME:
            return self._masked(name[1], service, time_ns)
        logged = self._memory.find(what, time_ns)
        if logged is None:
            raise Lost(f"it was fed {what} of {time_ns}, which is not in the take")
        return logged.received

    def _masked(self, viewer: str, service: Repeatable, time_ns: int) -> Masked:
        if service.learning:
            return Masked(0, time_ns, None)
        silhouette = self._memory.message(SILHOUETTE.at(self._rig.name, viewer=viewer), time_ns)
        if isinstance(silhouette, Silhouette):
            try:
                mask = unpack(silhouette.size, silhouette.region, silhouette.data)
            except ValueError as error:
                raise Lost(f"its silhouette of frame {silhouette.frame}: {error}") from error
            return Masked(silhouette.frame, time_ns, mask)
        sighting = self._memory.message(SIGHTING.at(self._rig.name, viewer=viewer), time_ns)
        if isinstance(sighting, Sighting) and not sighting.present:
            return Masked(sighting.frame, time_ns, None)
        if viewer in self._silent:
            raise Lost("its rig keeps silhouettes off the network (silhouette = false), so they are not in the take")
        raise Lost(f"its silhouette of {time_ns} is not in the take")

    def _feed(self, name: Name, service: Repeatable, event: Event) -> None:
        try:
            messages = service.step(event)
        except Exception:  # live, a step that fails says nothing and goes on from the state before
            return
        for message in messages:
            if isinstance(message, DERIVED):
                self._compare(message)

    def _compare(self, recomputed: Message) -> None:
        topic = topic_of(type(recomputed))
        key = topic.at(self._rig.name, **topic.names_of(recomputed))
        try:
            data = codec.encode(recomputed)
        except codec.BadMessage:
            return  # live, it was not sent either
        logged = self._memory.find(key, recomputed.captured_ns)
        if logged is None:
            self.found.unlogged[key] += 1
            return
        logged.checked = True
        if logged.received.data == data:
            self.found.equal[key] += 1
            return
        found = difference(key, logged.received.message, codec.decode(data, topic.message), self._tolerance)
        if found is None and self._tolerance:
            self.found.equal[key] += 1
            self.found.close += 1
            return
        self.found.different[key] += 1
        if self._first is None or logged.number < self._first:
            self._first = logged.number
            fields = ("the same fields in other bytes",)
            self.found.first = found or Difference(key, recomputed.frame, recomputed.captured_ns, fields)
