"""What is to be sent, in order, lap after lap: read, checked, renamed and shifted, so that sending is all that is left."""

import logging
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from common import codec
from common.bus.inbox import disagreeing_name
from common.bus.protocol import Envelope
from common.runtime.logs import OncePerSource
from common.take.reading import Recorded, envelope
from common.topics import Queueing, Topic, topic_at
from services.takes.replay.renaming import Renaming
from services.takes.replay.shifting import Reached, Shift, going_on, shifted
from services.takes.replay.timeline import Timeline

logger = logging.getLogger(__name__)

NO_PERIOD_NS = 100_000_000  # of a take with less than two messages on every key


@dataclass(frozen=True)
class Ready:
    """A message to be sent.

    line_ns: its place on the replay's time line, which goes on over laps.  place_ns: its place in the takes.
    captured_ns, frame: as sent, `shift` later than recorded.
    state: of a KEPT topic and from before the start, for those who listen now.
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
class Plan:
    """keys: new keys by recorded ones.  begin_ns, end_ns: places in the takes, end_ns excluded."""

    timeline: Timeline
    keys: dict[str, str]
    renaming: Renaming
    begin_ns: int
    end_ns: int
    loop: bool = False

    @property
    def period_ns(self) -> int:
        """The mean interval of the busiest key: what lies between two laps."""
        most = max((self.timeline.keys[key] for key in self.keys), default=0)
        return round(self.timeline.duration_ns / (most - 1)) if most > 1 else NO_PERIOD_NS


@dataclass(frozen=True)
class Start:
    """From `place_ns` of the takes, which is `line_ns` of the time line, in the lap of this number, with this shift."""

    place_ns: int
    line_ns: int
    lap: int = 1
    shift: Shift = field(default_factory=Shift)


class Laps:
    """Iterates over what is to be sent from `start` on; `bad` counts what could not be, by key."""

    def __init__(self, plan: Plan, start: Start, once: OncePerSource, bad: Counter[str]) -> None:
        self._plan, self._start = plan, start
        self._once, self._bad = once, bad

    def __iter__(self) -> Iterator[Ready]:
        """Raises TakeError when a file has gone."""
        plan, start = self._plan, self._start
        timeline, first_log_ns = plan.timeline, plan.timeline.log_at(plan.begin_ns)
        while True:
            reached: Reached | None = None
            lowest = last_ns = None
            state_keys = [key for key in plan.keys if _is_kept(key)]
            for recorded in timeline.last_before(start.place_ns, state_keys):
                ready = self._ready(recorded, start.place_ns, start, state=True)
                if ready is not None:
                    yield ready
            for placed in timeline.read(start.place_ns):
                if placed.place_ns >= plan.end_ns:
                    break
                ready = self._ready(placed.recorded, placed.place_ns, start)
                if ready is None:
                    continue
                last_ns = placed.place_ns
                lowest = ready.frame if lowest is None else min(lowest, ready.frame)
                before = reached or Reached(0, 0, 0)
                reached = before.further(ready.captured_ns, ready.frame, ready.log_ns)
                yield ready
            if not plan.loop or reached is None or last_ns is None or lowest is None:
                return
            if start.place_ns > plan.begin_ns:
                lowest = start.shift.frames  # of a lap begun in its middle, what comes before it is not known
            gap_ns = plan.period_ns
            shift = going_on(start.shift, reached, first_log_ns, lowest - start.shift.frames, gap_ns)
            line_ns = start.line_ns + last_ns - start.place_ns + gap_ns
            start = Start(plan.begin_ns, line_ns, start.lap + 1, shift)

    def _ready(self, recorded: Recorded, place_ns: int, start: Start, *, state: bool = False) -> Ready | None:
        """None for what is not selected, or no valid message."""
        key = self._plan.keys.get(recorded.topic)
        if key is None:
            return None
        try:
            found = envelope(recorded)
            if found is None:
                return None
            wrong = disagreeing_name(found.topic, found.key, found.message)
            if wrong is not None:
                raise codec.BadMessage(wrong)
            message, data = found.message, self._bytes(found, start.shift)
        except codec.BadMessage as error:
            self._bad[recorded.topic] += 1
            self._once.warn(recorded.topic, "invalid", f"left out: {error}")
            return None
        return Ready(
            line_ns=start.line_ns + place_ns - start.place_ns,
            place_ns=place_ns,
            log_ns=recorded.log_ns,
            lap=start.lap,
            topic=found.topic,
            key=key,
            data=data,
            captured_ns=message.captured_ns + start.shift.time_ns,
            frame=message.frame + start.shift.frames,
            shift=start.shift,
            state=state,
        )

    def _bytes(self, found: Envelope, shift: Shift) -> bytes:
        """The recorded bytes, unless names or times in them are to be others.  Raises BadMessage."""
        message = found.message
        if self._plan.renaming:
            message = self._plan.renaming.message(found.topic, message, found.key)
        if shift:
            message = shifted(message, shift)
        return found.data if message == found.message else codec.encode(message)


def _is_kept(key: str) -> bool:
    topic = topic_at(key)
    return topic is not None and topic.queueing is Queueing.KEPT
