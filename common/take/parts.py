"""A take in parts: a new file by size and by time, each of which stands by itself.

Each part is a whole MCAP file.  It begins with the messages of KEPT topics that came before it (bodies, cameras), logged
again at its own beginning, so that it can be read, replayed and exported alone.  Its metadata `part` says which `take` it
belongs to (the name of the first part), its `number` from 1, the `previous` part, and in `repeated` how many messages
at its beginning, counting MessagePack channels alone, a reader of all parts leaves out.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from common.bus.protocol import Envelope
from common.take.naming import free_name
from common.take.recording import Recording, RecordingError, Statistics, TakeExists
from common.topics import Queueing

logger = logging.getLogger(__name__)

MAX_KEPT = 1024  # messages repeated in each part
SET_BACK_NS = 60_000_000_000  # messages that are so much older than the part mean that the clock was set back
NOTHING = Statistics(0, 0, 0, None)
ATTEMPTS = 10  # at a name that others take at the same moment

# A recording at a path, from a time on, with these metadata for `part`; none when there is one part only.
OpenPart: TypeAlias = Callable[[Path, int, Mapping[str, str] | None], Recording]
NamePart: TypeAlias = Callable[[int], Path]


@dataclass(frozen=True)
class PartLimits:
    """When a part ends: at so many bytes, or after so many nanoseconds of messages; 0 for never.

    A part passes its size by what is written at once: a second of messages, and the index.
    """

    bytes: int = 0
    ns: int = 0

    @classmethod
    def of(cls, megabytes: float, minutes: float) -> "PartLimits":
        """10^6 bytes and minutes, as in rig files and on the command line."""
        return cls(round(megabytes * 1e6), round(minutes * 60e9))

    def __bool__(self) -> bool:
        return bool(self.bytes or self.ns)


class Parts:
    """Writes as a `Recording` does.  What cannot be opened or written later ends the parts, never their caller."""

    def __init__(
        self,
        open_part: OpenPart,
        path: Path,
        start_ns: int,
        limits: PartLimits = PartLimits(),
        name_part: NamePart | None = None,
        *,
        must_open: bool = True,
    ) -> None:
        """path: of the first part.  name_part: of a later one that begins at a time; default: the first with -2, -3 ...

        must_open: raise RecordingError when the first part cannot be opened; else that is said, and a `failure`.
        """
        self._open_part = open_part
        self._name_part = name_part or (lambda _: path)
        self._limits = limits
        self._first = path
        self._number = 1
        self._start_ns: int | None = None  # log time of the part's first message that is new
        self._kept: dict[str, Envelope] = {}
        # Of the parts that are closed; the open one; what was repeated in it.  One value, for other threads read it.
        self._standing: tuple[Statistics, Recording | None, Statistics] = (NOTHING, None, NOTHING)
        self._failure: str | None = None
        self.path = path
        try:
            self._standing = (NOTHING, self._opened(path, start_ns, ""), NOTHING)
        except RecordingError as error:
            if must_open:
                raise
            self._fail(error)

    @property
    def statistics(self) -> Statistics:
        """Of all parts; a message that is repeated counts once."""
        before, recording, repeated = self._standing
        now = recording.statistics if recording else NOTHING
        return Statistics(
            before.messages + max(0, now.messages - repeated.messages),
            before.bytes + max(0, now.bytes - repeated.bytes),
            before.lost + now.lost,
            self._failure or now.failure,
            before.unshown + now.unshown,
        )

    @property
    def failure(self) -> str | None:
        recording = self._recording
        return self._failure or (recording.failure if recording else None)

    @property
    def _recording(self) -> Recording | None:
        return self._standing[1]

    @property
    def number(self) -> int:
        """Of the part being written, from 1."""
        return self._number

    def record(self, envelope: Envelope) -> None:
        """Write one message as it came, in a new part if the present one is full."""
        if self._full(envelope.received_ns):
            self._turn(envelope.received_ns)
        if self._start_ns is None:
            self._start_ns = envelope.received_ns
        recording = self._recording
        if recording is None:
            before, *_ = self._standing
            self._standing = (replace(before, lost=before.lost + 1), None, NOTHING)
            return
        recording.record(envelope)
        kept = envelope.topic.queueing is Queueing.KEPT and (envelope.key in self._kept or len(self._kept) < MAX_KEPT)
        if self._limits and kept:
            self._kept[envelope.key] = envelope

    def flush(self) -> None:
        """Bring everything to the disk now."""
        if self._recording:
            self._recording.flush()

    def close(self) -> Statistics:
        """Finish the part with its index; may be called twice."""
        if self._recording:
            self._recording.close()
        return self.statistics

    def _full(self, now_ns: int) -> bool:
        if self._recording is None or self._start_ns is None or self._recording.failure:
            return False
        if self._limits.bytes and self._recording.size_bytes >= self._limits.bytes:
            return True
        return bool(self._limits.ns) and not -SET_BACK_NS <= now_ns - self._start_ns < self._limits.ns

    def _turn(self, now_ns: int) -> None:
        """Close the part and open the next."""
        previous = self.path
        before = self.close()
        self._standing = (before, None, NOTHING)
        if before.failure:
            self._failure = before.failure
            return
        self._number += 1
        self._start_ns = None
        try:
            part = self._opened(self._name_part(now_ns), now_ns, previous.name)
        except (RecordingError, OSError) as error:
            self._fail(error)
            return
        for envelope in self._kept.values():
            part.record(replace(envelope, received_ns=now_ns))  # a reader's time line begins with the part
        self._standing = (before, part, part.statistics)

    def _opened(self, path: Path, start_ns: int, previous: str) -> Recording:
        part = {
            "take": self._first.name,
            "number": str(self._number),
            "previous": previous,
            "repeated": str(len(self._kept)),
        }
        for _ in range(ATTEMPTS):
            self.path = free_name(path) if self._number > 1 else path
            try:
                return self._open_part(self.path, start_ns, part if self._limits else None)
            except TakeExists:
                if self._number == 1:
                    raise
        raise RecordingError(f"{self.path}: its name was taken {ATTEMPTS} times while it was opened")

    def _fail(self, error: Exception) -> None:
        self._failure = f"{error}; the log stops"
        logger.error("%s", self._failure)
