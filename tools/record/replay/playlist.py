"""Messages of a replay in order, validated, remapped and shifted."""

import logging
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import msgspec

from zenocap.common import codec
from zenocap.common.bus.inbox import disagreeing_name
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import ENDED, PROCESS, SENT, Health
from zenocap.common.recording.reader import Recorded, envelope
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.topics import Queueing, Topic, topic_at
from zenocap.tools.record.replay.remap import Remapping
from zenocap.tools.record.replay.time_shift import ReplayProgress, Shift, continued, shifted
from zenocap.tools.record.replay.timeline import Timeline

logger = logging.getLogger(__name__)

NO_PERIOD_NS = 100_000_000  # for a take with less than two messages on every key


@dataclass(frozen=True)
class PreparedMessage:
    """A message ready to publish.

    line_ns: its place on the replay's time line, which continues over laps.  place_ns: its place in the takes.
    captured_ns, frame: as published, `shift` later than recorded.
    state: of a latched topic, from before the start.
    """

    line_ns: int
    place_ns: int
    log_ns: int
    lap: int
    topic: Topic
    key: str
    data: bytes
    captured_ns: int
    frame: int
    shift: Shift
    state: bool = False


@dataclass(frozen=True)
class ReplayPlan:
    """Plan of a replay.  keys: new keys by recorded ones.  begin_ns, end_ns: places in the takes, end_ns excluded."""

    timeline: Timeline
    keys: dict[str, str]
    remapping: Remapping
    begin_ns: int
    end_ns: int
    loop: bool = False

    @property
    def period_ns(self) -> int:
        """Mean interval of the most frequent key, used as the gap between two laps."""
        most = max((self.timeline.keys[key] for key in self.keys), default=0)
        return round(self.timeline.duration_ns / (most - 1)) if most > 1 else NO_PERIOD_NS


@dataclass(frozen=True)
class Start:
    """Start at `place_ns` of the takes, `line_ns` of the time line, in lap `lap`, with `shift`."""

    place_ns: int
    line_ns: int
    lap: int = 1
    shift: Shift = field(default_factory=Shift)


class Playlist:
    """Iterates over the messages from `start` on; `bad` counts invalid ones by key."""

    def __init__(self, plan: ReplayPlan, start: Start, log_once: OncePerSource, bad: Counter[str]) -> None:
        self._plan, self._start = plan, start
        self._log_once, self._bad = log_once, bad

    def __iter__(self) -> Iterator[PreparedMessage]:
        """Yield the messages in order.  Raises UserError when a file has been removed."""
        plan, start = self._plan, self._start
        timeline, first_log_ns = plan.timeline, plan.timeline.log_at(plan.begin_ns)
        while True:
            reached: ReplayProgress | None = None
            lowest = last_ns = None
            state_keys = [key for key in plan.keys if _is_kept(key)]
            for recorded in timeline.last_before(start.place_ns, state_keys):
                if (prepared := self._prepared(recorded, start.place_ns, start, state=True)) is not None:
                    yield prepared
            for placed in timeline.read(start.place_ns):
                if placed.place_ns >= plan.end_ns:
                    break
                if (prepared := self._prepared(placed.recorded, placed.place_ns, start)) is None:
                    continue
                last_ns = placed.place_ns
                lowest = prepared.frame if lowest is None else min(lowest, prepared.frame)
                reached = (reached or ReplayProgress()).advanced(prepared.captured_ns, prepared.frame, prepared.log_ns)
                yield prepared
            if not plan.loop or reached is None or last_ns is None or lowest is None:
                return
            if start.place_ns > plan.begin_ns:
                lowest = start.shift.frames  # of a lap begun in its middle, the frames before are unknown
            gap_ns = plan.period_ns
            shift = continued(start.shift, reached, first_log_ns, lowest - start.shift.frames, gap_ns)
            line_ns = start.line_ns + last_ns - start.place_ns + gap_ns
            start = Start(plan.begin_ns, line_ns, start.lap + 1, shift)

    def _prepared(self, recorded: Recorded, place_ns: int, start: Start, *, state: bool = False) -> PreparedMessage | None:
        """The prepared message; None when it is not selected or not valid."""
        if (key := self._plan.keys.get(recorded.topic)) is None:
            return None
        try:
            if (found := envelope(recorded)) is None:
                return None
            if (wrong := disagreeing_name(found.topic, found.key, found.message)) is not None:
                raise codec.BadMessage(wrong)
            message, data = found.message, self._bytes(found, start.shift)
        except codec.BadMessage as error:
            self._bad[recorded.topic] += 1
            self._log_once.warn(recorded.topic, "invalid", f"left out: {error}")
            return None
        return PreparedMessage(
            line_ns=start.line_ns + place_ns - start.place_ns, place_ns=place_ns, log_ns=recorded.log_ns, lap=start.lap,
            topic=found.topic, key=key, data=data, captured_ns=message.captured_ns + start.shift.time_ns,
            frame=message.frame + start.shift.frames, shift=start.shift, state=state,
        )  # fmt: skip

    def _bytes(self, found: Envelope, shift: Shift) -> bytes:
        """The recorded bytes, re-encoded only where names, times or counts change.  Raises BadMessage."""
        message = found.message
        if self._plan.remapping:
            message = self._plan.remapping.message(found.topic, message, found.key)
        if shift:
            message = shifted(message, shift)
        if message != found.message and isinstance(message, Health):  # what it sent is not of this process
            own = [name for name in message.counts if name.startswith(SENT) or name in (PROCESS, ENDED)]
            counts = {name: count for name, count in message.counts.items() if name not in own}
            message = msgspec.structs.replace(message, counts=counts)
        return found.data if message == found.message else codec.encode(message)


def _is_kept(key: str) -> bool:
    topic = topic_at(key)
    return topic is not None and topic.queueing is Queueing.LATCHED
