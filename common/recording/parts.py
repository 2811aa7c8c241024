"""Takes in parts: a new file by size or time, each self-contained.

Each part is a complete MCAP file.  It begins with the earlier messages of LATCHED topics (bodies, cameras), logged
again at its own beginning, so that it can be read, replayed and exported alone.  Its metadata `part` holds the `take`
it belongs to (the name of the first part), its `number` from 1, the `previous` part, and in `repeated` the number of
messages at its beginning (MessagePack channels only) that a reader of all parts skips.

A file that is deleted or moved while it is written is continued in a new one, as a part.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeAlias

from zenocap.common.bus.protocol import Envelope
from zenocap.common.recording.writer import Closing, Recording, RecordingError, Statistics, TakeExists
from zenocap.common.topics import Queueing

logger = logging.getLogger(__name__)

SET_BACK_NS = 60_000_000_000  # age of a message relative to the part above which the clock was set back; chosen by hand
NOTHING = Statistics(0, 0, 0, None)
ATTEMPTS = 10  # to find a free name while other processes create files; chosen by hand

# Opens a recording: path, start time, metadata `part` (none when there is one part only).
OpenPart: TypeAlias = Callable[[Path, int, Mapping[str, str] | None], Recording]
NamePart: TypeAlias = Callable[[int], Path]


@dataclass(frozen=True)
class PartLimits:
    """Largest size (bytes) and duration (ns of messages) of a part; 0 for unlimited.

    A part exceeds its size by its beginning (the files of the rig, with the posture model), at most one write, a second of
    messages, and the index.
    """

    bytes: int = 0
    ns: int = 0

    @classmethod
    def of(cls, megabytes: float, minutes: float) -> "PartLimits":
        """Limits in 10^6 bytes and minutes, as in rig files and on the command line."""
        return cls(round(megabytes * 1e6), round(minutes * 60e9))

    def __bool__(self) -> bool:
        return bool(self.bytes or self.ns)


class Parts:
    """Recording in parts, with the methods of `Recording`.  Later errors end the recording, never its caller."""

    def __init__(
        self, open_part: OpenPart, path: Path, start_ns: int, limits: PartLimits = PartLimits(),
        name_part: NamePart | None = None, *, must_open: bool = True,
    ) -> None:  # fmt: skip
        """path: of the first part.  name_part: path of a later part by its start; default: the first with -2, -3 ...

        must_open: raise RecordingError when the first part cannot be opened; otherwise it is logged and is a `failure`.
        """
        self._open_part = open_part
        self._name_part = name_part or (lambda _: path)
        self._limits = limits
        self._first = path
        self._number = 1
        self._start_ns: int | None = None  # log time of the part's first message that is not repeated
        self._last_ns = start_ns  # receive time of the last message
        self._kept: dict[str, Envelope] = {}
        # Statistics of the closed parts; the open part; statistics of its repeated messages.  One value, because other
        # threads read it.
        self._begin_bytes = 0  # of a part, before its messages
        self._standing: tuple[Statistics, Recording | None, Statistics] = (NOTHING, None, NOTHING)
        self._failure: str | None = None
        self.closing: Closing = dict  # metadata to write at the end of each part
        self.path = path
        try:
            self._standing = (NOTHING, self._opened(path, start_ns, ""), NOTHING)
        except RecordingError as error:
            if must_open:
                raise
            self._fail(error)

    @property
    def statistics(self) -> Statistics:
        """Statistics of all parts; a repeated message counts once."""
        before, recording, repeated = self._standing
        now = recording.statistics if recording else NOTHING
        return Statistics(
            before.messages + max(0, now.messages - repeated.messages), before.bytes + max(0, now.bytes - repeated.bytes),
            before.lost + now.lost, self._failure or now.failure, before.unconverted + now.unconverted, before.removed,
        )  # fmt: skip

    @property
    def failure(self) -> str | None:
        recording = self._recording
        return self._failure or (recording.failure if recording else None)

    @property
    def _recording(self) -> Recording | None:
        return self._standing[1]

    @property
    def number(self) -> int:
        """Number of the part being written, from 1."""
        return self._number

    def record(self, envelope: Envelope) -> None:
        """Write a message as received, in a new part if the current one is full."""
        self._last_ns = envelope.received_ns
        if self._full(envelope.received_ns):
            self._next_part(envelope.received_ns)
        if self._start_ns is None:
            self._start_ns = envelope.received_ns
        recording = self._recording
        if recording is None:
            before, *_ = self._standing
            self._standing = (replace(before, lost=before.lost + 1), None, NOTHING)
            return
        if recording.record(envelope) and envelope.topic.queueing is Queueing.LATCHED:  # see `ChannelLimits`
            self._kept[envelope.key] = envelope

    def flush(self) -> None:
        """Write everything to disk now, in a new file if the current one was deleted or moved."""
        if self._recording:
            self._recording.flush()
            self._replace_removed(last=False)

    def close(self) -> Statistics:
        """Finish the part with its index; may be called twice."""
        if self._recording:
            self._replace_removed(last=True)
        if self._recording:
            self._closed(self._recording)
        return self.statistics

    def _full(self, now_ns: int) -> bool:
        if self._recording is None or self._start_ns is None or self._recording.failure:
            return False
        if self._limits.bytes and self._recording.size_bytes - self._begin_bytes >= self._limits.bytes:
            return True
        return bool(self._limits.ns) and not -SET_BACK_NS <= now_ns - self._start_ns < self._limits.ns

    def _next_part(self, now_ns: int) -> None:
        """Close the part and open the next."""
        if self._recording:
            self._closed(self._recording)
        before = self.statistics
        self._standing = (before, None, NOTHING)
        if before.failure:
            self._failure = before.failure
            return
        self._open_next(now_ns)

    def _replace_removed(self, *, last: bool) -> None:
        """Continue in a new file when the current one was deleted or moved.  last: no more messages follow."""
        before, recording, repeated = self._standing
        removal = recording.removal() if recording else None
        if recording is None or removal is None:
            return
        path, now = self.path, self._closed(recording)
        gone = max(0, now.messages - repeated.messages) if removal == "deleted" else 0
        if gone:
            before = replace(before, lost=before.lost + now.lost + gone, unconverted=before.unconverted + now.unconverted)
        else:
            before = self.statistics
        before = replace(before, removed=before.removed + 1)
        self._standing = (before, None, NOTHING)
        if now.failure:
            self._failure = now.failure
        elif not last:
            self._open_next(self._last_ns)
        logger.error(
            "%s was %s while it was written%s%s", path, removal, f": {gone} messages are lost" if gone else "",
            "" if last or self._failure else f"; the take continues in {self.path}",
        )  # fmt: skip

    def _closed(self, recording: Recording) -> Statistics:
        recording.closing = self.closing
        return recording.close()

    def _open_next(self, now_ns: int) -> None:
        previous, before = self.path, self._standing[0]
        self._number += 1
        self._start_ns = None
        try:
            part = self._opened(self._name_part(now_ns), now_ns, previous.name)
        except (RecordingError, OSError) as error:
            self._fail(error)
            return
        for envelope in self._kept.values():
            part.record(replace(envelope, received_ns=now_ns))  # the time line of a reader begins with the part
        self._standing = (before, part, part.statistics)

    def _opened(self, path: Path, start_ns: int, previous: str) -> Recording:
        part = {
            "take": self._first.name, "number": str(self._number), "previous": previous, "repeated": str(len(self._kept)),
        }  # fmt: skip
        for _ in range(ATTEMPTS):
            self.path = free_name(path) if self._number > 1 else path
            try:
                recording = self._open_part(self.path, start_ns, part if self._limits or self._number > 1 else None)
            except TakeExists:
                if self._number == 1:
                    raise
                continue
            self._begin_bytes = recording.size_bytes
            return recording
        raise RecordingError(f"{self.path}: its name was taken {ATTEMPTS} times while it was opened")

    def _fail(self, error: Exception) -> None:
        self._failure = f"{error}; the log stops"
        logger.error("%s", self._failure)


def take_path(rig: str, folder: Path, now_ns: int) -> Path:
    """Path of a new take: the rig's name and the time (UTC), with a suffix if it exists."""
    return free_name(folder / f"{rig}-{datetime.fromtimestamp(now_ns // 10**9, UTC):%Y%m%dT%H%M%SZ}.mcap")


def free_name(path: Path) -> Path:
    """`path`, with the suffix -2, -3 ... if it exists."""
    free, number = path, 2
    while _exists(free):
        free, number = path.with_name(f"{path.stem}-{number}{path.suffix}"), number + 1
    return free


def _exists(path: Path) -> bool:
    """Whether the path exists; False in an unreadable folder, where opening the file raises the error."""
    try:
        return path.exists()
    except PermissionError:
        return False
