"""Recomputation of a take: steps on their recorded inputs.

Inputs are the recorded messages, and for a viewer's frames the recorded silhouettes.  The messages that the steps then
publish must equal those of the take byte for byte.  A service can be recomputed from its start up to the first input that
is not in the take.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from zenocap.common import codec
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.errors import UserError
from zenocap.common.messages import BothWaysPose, Handled, Message, Sighting, Silhouette, Verdict
from zenocap.common.recording.reader import Take
from zenocap.common.recording.setup_file import SETUP_FILE, RecordedRig
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.input_trace import ALIVE, FRAME, GONE, TICK
from zenocap.common.topics import SIGHTING, SILHOUETTE, service_at, topic_of
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.tools.verdict.evidence import Evidence
from zenocap.tools.verdict.verdict import verdict_of
from zenocap.tools.verify.both_ways import verify_both_ways
from zenocap.tools.verify.result import Difference, Reason, Verification, difference
from zenocap.tools.verify.services import Event, Recomputed, is_learning, services_of
from zenocap.tools.verify.take_messages import DERIVED, MessageStore, first_trace_ns, messages_of, setup_in
from zenocap.tools.verify.verdict import verify_verdict

LATE_NS = 2_000_000_000  # longest time from handling an input to the log of the resulting messages; chosen by hand
UPDATE_EVERY = 256  # messages between two calls of `watch`


@dataclass
class _Recomputed:
    """A service and the number of its next input, None while inputs are missing."""

    service: Recomputed
    next: int | None = None


class MissingInput(Exception):
    """An input of a service is not in the take; the text names it."""


def verify(paths: Sequence[Path], tolerance: float = 0.0, watch: Callable[[int], None] = lambda _: None) -> Verification:
    """Verify one take, or the parts of one in any order.  watch: is called with the number of messages read.

    tolerance: allowed difference of numbers, relative or absolute.  Raises UserError for a file that is not a take or has
    no setup.
    """
    check: _Check | None = None
    count, both_ways = 0, False
    evidence = Evidence()
    verdict: tuple[Envelope, Verdict] | None = None  # recorded, and on the messages before it
    for path in sorted(paths, key=first_trace_ns) if len(paths) > 1 else paths:
        take = Take(path)
        for received in messages_of(take):
            if check is None:
                check = _Check(path, setup_in(path, take), take.attachments, tolerance)
                check.found.versions = take.metadata.get("versions", {})
            check.add(received)
            if isinstance(received.message, Verdict):
                verdict = received, verdict_of(evidence)
            evidence.add(received.message)
            count += 1
            both_ways = both_ways or isinstance(received.message, BothWaysPose)
            if count % UPDATE_EVERY == 0:
                watch(count)
        if take.cut and check is not None:
            check.found.reasons.append(Reason(None, take.cut))
    if check is None:
        raise UserError(f"{paths[0]}: no message of zenocap in it: there is nothing to verify")
    check.close()
    if both_ways and len(paths) == 1 and not take.cut:
        verify_both_ways(paths[0], check.rig, take.attachments, check.found, tolerance)
    elif both_ways:
        check.found.reasons.append(Reason(None, "poses from both directions: only of a whole take in one file"))
    if not check.found.checked:
        reasons = "; ".join(map(str, check.found.reasons)) or "no service has published its input trace"
        raise UserError(f"{paths[0]}: nothing can be verified: {reasons}")
    if verdict is not None:
        verify_verdict(*verdict, check.found, tolerance, whole=len(paths) == 1)
    return check.found


class _Check:
    """One pass over a take, in bounded memory."""

    def __init__(self, path: Path, rig: RecordedRig, attached: Mapping[str, bytes], tolerance: float) -> None:
        self.found = Verification()
        self.rig, self._tolerance = rig, tolerance
        try:
            self._services = {name: _Recomputed(service) for name, service in services_of(rig, path, attached).items()}
        except ValueError as error:
            raise UserError(f"{path}: attachment {SETUP_FILE}: {error}") from error
        self._without_silhouette = {viewer.id for viewer in rig.viewers if not viewer.silhouette}
        self._store = MessageStore()
        self._traces: deque[Envelope] = deque()  # not recomputed yet, for LATE_NS
        self._traced: set[ServiceKey] = set()  # services with an input trace
        self._start_ns: int | None = None
        self._first: int | None = None  # number of the first message that differs

    def add(self, received: Envelope) -> None:
        """Process the next message of the take."""
        now_ns = received.received_ns
        self._start_ns = now_ns if self._start_ns is None else self._start_ns
        self.found.duration_s = max(self.found.duration_s, (now_ns - self._start_ns) / 1e9)
        if isinstance(received.message, Handled):
            self._traces.append(received)
        elif not isinstance(received.message, BothWaysPose | Verdict):  # the last pose is an input: see `verify_both_ways`
            self._store.add(received)
        while self._traces and self._traces[0].received_ns < now_ns - LATE_NS:
            self._recompute(self._traces.popleft().message)

    def close(self) -> None:
        while self._traces:
            self._recompute(self._traces.popleft().message)
        self._store.close()
        self.found.unchecked = self._store.unchecked
        untraced = {service_at(key) for key in self.found.unchecked} - self._traced
        for name in sorted(name for name in untraced if name is not None):
            self._add_reason(name, "its input trace is not in the take")
        if self.found.checked and self.found.unchecked and not self.found.reasons:
            self.found.reasons.append(Reason(None, "published after the last input trace"))

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

    def _event(self, name: ServiceKey, service: Recomputed, entry: str, time_ns: int) -> Event:
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

    def _masked(self, viewer: str, service: Recomputed, time_ns: int) -> SegmentedFrame:
        """A frame with the recorded silhouette in place of the image.  Raises MissingInput."""
        if is_learning(service):
            return SegmentedFrame(0, time_ns, None)
        silhouette = self._store.message(SILHOUETTE.at(self.rig.name, viewer=viewer), time_ns)
        if isinstance(silhouette, Silhouette):
            try:
                mask = unpack(silhouette.size, silhouette.region, silhouette.data)
            except ValueError as error:
                raise MissingInput(f"its silhouette of frame {silhouette.frame}: {error}") from error
            return SegmentedFrame(silhouette.frame, time_ns, mask)
        sighting = self._store.message(SIGHTING.at(self.rig.name, viewer=viewer), time_ns)
        if isinstance(sighting, Sighting) and not sighting.present:
            return SegmentedFrame(sighting.frame, time_ns, None)
        if viewer in self._without_silhouette:
            raise MissingInput("its silhouettes are not in the take, because its rig has silhouette = false")
        raise MissingInput(f"its silhouette of {time_ns} is not in the take")

    def _step(self, service: Recomputed, event: Event) -> None:
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
