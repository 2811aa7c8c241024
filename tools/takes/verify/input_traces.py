"""Steps of a take's services on their recorded inputs, in the order of the input traces.

Inputs are the recorded messages, and for a viewer's frames the recorded silhouettes.  A service can be recomputed from its
start up to the first input that is not in the take.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from zenocap.common import codec
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.conversion import silhouette_mask
from zenocap.common.errors import UserError
from zenocap.common.messages import BothWaysPose, Handled, Message, Sighting, Silhouette, Verdict
from zenocap.common.observe.account import Account
from zenocap.common.recording.setup_file import SETUP_FILE, RecordedRig
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.input_trace import ALIVE, FRAME, GONE, TICK
from zenocap.common.topics import SIGHTING, SILHOUETTE, service_at, topic_at, topic_of
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.services.viewer.states import LearningBackground
from zenocap.tools.takes.members import Stepped, steppers
from zenocap.tools.takes.verify.result import Reason, Verification
from zenocap.tools.takes.verify.take_messages import DERIVED, MessageStore

LATE_NS = 2_000_000_000  # longest time from handling an input to the log of the resulting messages; chosen by hand

Event = SegmentedFrame | Envelope | Alive | Tick


@dataclass
class _Traced:
    """A service and the number of its next input, None while inputs are missing."""

    service: Stepped
    next: int | None = None


class MissingInput(Exception):
    """An input of a service is not in the take; the text names it."""


class Recomputation:
    """One pass over a take, in bounded memory."""

    def __init__(self, path: Path, rig: RecordedRig, attached: Mapping[str, bytes], tolerance: float) -> None:
        self.found = Verification()
        self.rig, self._tolerance = rig, tolerance
        try:
            self._services = {name: _Traced(service) for name, service in steppers(rig, path, attached).items()}
        except ValueError as error:
            raise UserError(f"{path}: attachment {SETUP_FILE}: {error}") from error
        self._without_silhouette = {viewer.id for viewer in rig.viewers if not viewer.silhouette}
        self._store, self._account = MessageStore(), Account(own=self._services)
        self._traces: deque[Envelope] = deque()  # not recomputed yet, for LATE_NS
        self._traced: set[ServiceKey] = set()  # services with an input trace
        self._start_ns: int | None = None
        self._first: int | None = None  # number of the first message that differs

    def add(self, received: Envelope) -> None:
        """Process the next message of the take."""
        now_ns = received.received_ns
        self._account.add(received)
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        self.found.duration_s = max(self.found.duration_s, (now_ns - self._start_ns) / 1e9)
        if isinstance(received.message, Handled):
            self._traces.append(received)
        elif not isinstance(received.message, BothWaysPose | Verdict):  # see `recompute`
            self._store.add(received)
        while self._traces and self._traces[0].received_ns < now_ns - LATE_NS:
            self._recompute(self._traces.popleft().message)

    def close(self) -> None:
        while self._traces:
            self._recompute(self._traces.popleft().message)
        self._store.close()
        self.found.unchecked = self._store.unchecked
        self._excuse_lost()
        untraced = {service_at(key) for key in self.found.unchecked} - self._traced
        for name in sorted(name for name in untraced if name is not None):
            self._add_reason(name, "its input trace is not in the take")
        if self.found.checked and self.found.unchecked and not self.found.reasons:
            self.found.reasons.append(Reason(None, "published after the last input trace"))

    def _excuse_lost(self) -> None:
        """Tell messages that were lost on the way to the log, as the healths in the take say, from others."""
        lines = self._account.lines()
        for key, count in self.found.unlogged.items():
            service, topic = service_at(key), topic_at(key)
            if service is None or topic is None:
                continue
            line = lines.get((service, topic.name))
            if line is not None and line.missing:
                lost = self.found.lost[key] = min(count, line.missing)
                self._add_reason(service, f"{lost} of its messages {topic.name} were lost on the way to the log")
        self.found.unlogged -= self.found.lost

    def _recompute(self, trace: Message) -> None:
        """Run a service on its inputs since the last trace."""
        assert isinstance(trace, Handled)
        name = (trace.service, trace.id)
        self._traced.add(name)
        recomputed = self._services.get(name)
        if recomputed is None:
            if name[0] == "recognizer" and not self._has_reason(name):
                self._add_reason(name, "its model is not in the take")
            return
        if trace.first == 0:
            recomputed.service.restart()
        elif recomputed.next != trace.first:
            if recomputed.next is not None or trace.frame == 0 or not self._has_reason(name):
                self._add_reason(name, f"its inputs before number {trace.first} are not in the take")
            recomputed.next = None
            return
        recomputed.next = trace.first + len(trace.events)
        try:
            for index, time_ns in trace.events:
                entry = trace.keys[index] if index < len(trace.keys) else f"key {index}"
                self._step(recomputed.service, self._event(name, recomputed.service, entry, time_ns))
        except MissingInput as missing:
            recomputed.next = None
            self._add_reason(name, str(missing))

    def _has_reason(self, name: ServiceKey) -> bool:
        return any(reason.service == name for reason in self.found.reasons)

    def _add_reason(self, name: ServiceKey, text: str) -> None:
        self.found.reasons.append(Reason(name, text))

    def _event(self, name: ServiceKey, service: Stepped, entry: str, time_ns: int) -> Event:
        """Input of one entry of a trace.  Raises MissingInput."""
        kind, _, subject = entry.partition("/")
        if entry == TICK:
            return Tick(time_ns)
        if kind in (ALIVE, GONE) and subject.count("/") == 1:
            service_name, _, id = subject.partition("/")
            return Alive(service_name, id, kind == ALIVE, time_ns)
        if entry == FRAME:
            return self._masked(name[1], service, time_ns)
        logged = self._store.find(entry, time_ns)
        if logged is None:
            raise MissingInput(f"its input {entry} of {time_ns} is not in the take")
        return logged.received

    def _masked(self, viewer: str, service: Stepped, time_ns: int) -> SegmentedFrame:
        """A frame with the recorded silhouette in place of the image.  Raises MissingInput."""
        if isinstance(service.state, LearningBackground):  # frames have no silhouette yet
            return SegmentedFrame(0, time_ns, None)
        silhouette = self._store.message(SILHOUETTE.at(self.rig.name, viewer=viewer), time_ns)
        if isinstance(silhouette, Silhouette):
            try:
                mask = silhouette_mask(silhouette)
            except ValueError as error:
                raise MissingInput(f"its silhouette of frame {silhouette.frame}: {error}") from error
            return SegmentedFrame(silhouette.frame, time_ns, mask)
        sighting = self._store.message(SIGHTING.at(self.rig.name, viewer=viewer), time_ns)
        if isinstance(sighting, Sighting) and not sighting.present:
            return SegmentedFrame(sighting.frame, time_ns, None)
        if viewer in self._without_silhouette:
            raise MissingInput("its silhouettes are not in the take, because its rig has silhouette = false")
        raise MissingInput(f"its silhouette of {time_ns} is not in the take")

    def _step(self, service: Stepped, event: Event) -> None:
        try:
            messages = service.step(event)
        except Exception:  # live, a step that fails publishes nothing and keeps the state before
            return
        for message in messages:
            if isinstance(message, DERIVED):
                self._compare(message)

    def _compare(self, recomputed: Message) -> None:
        topic = topic_of(type(recomputed))
        key = topic.at(self.rig.name, **topic.names_of(recomputed))
        try:
            data = codec.encode(recomputed)
        except codec.BadMessage:
            return  # live, it was not published either
        logged = self._store.find(key, recomputed.captured_ns)
        if logged is None:
            self.found.unlogged[key] += 1
            return
        logged.checked = True
        found = self.found.compare(logged.received, data, self._tolerance)
        if found is not None and (self._first is None or logged.number < self._first):
            self._first, self.found.first = logged.number, found
