"""Takes on one time line: duration, keys, and reading from any place.

A place is in nanoseconds since the beginning of the first take, by log_time.  Takes follow one another; the gap between
two, such as the files of one recording, is kept up to LONGEST_GAP_NS.
"""

import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

from mcap.records import ChunkIndex, Message

from zenocap.common.errors import UserError
from zenocap.common.recording.mcap_content import BrokenChunk
from zenocap.common.recording.mcap_records import Records
from zenocap.common.recording.reader import Recorded, TakeReader, recorded_of
from zenocap.common.recording.summary import Summary, chunk_messages, read_summary

logger = logging.getLogger(__name__)

LONGEST_GAP_NS = 10_000_000_000  # between two takes that is waited for; chosen by hand
CLOCK_STEP_NS = 1_000_000_000  # a log_time further back than this shows that the clock was set back; chosen by hand


@dataclass(frozen=True)
class PlayedPart:
    """One take.  start_ns, end_ns: its first and last log_time.  keys: messages by key.

    index: with which it is read from any log_time without reading the messages before; None without a whole one.
    """

    path: Path
    start_ns: int
    end_ns: int
    keys: dict[str, int]
    index: Summary | None = field(default=None, repr=False)


@dataclass(frozen=True)
class PlacedMessage:
    """A message and its place."""

    place_ns: int
    recorded: Recorded


class Timeline:
    """The takes, ordered by start time.  lost: missing content by take, known after reading."""

    def __init__(self, paths: Sequence[Path]) -> None:
        """Open the takes.  Raises UserError for a file that is not a take."""
        self.lost: dict[Path, str] = {}
        self.parts = tuple(sorted(map(self._part, paths), key=lambda part: part.start_ns))
        self._begins_ns: list[int] = []
        end_ns = before_ns = 0
        for number, part in enumerate(self.parts):
            gap_ns = part.start_ns - before_ns if number else 0
            if gap_ns < 0:
                logger.warning("%s begins before the previous take has ended: played after it", part.path)
            self._begins_ns.append(end_ns + (gap_ns if 0 <= gap_ns <= LONGEST_GAP_NS else 0))
            end_ns, before_ns = self._begins_ns[-1] + part.end_ns - part.start_ns, part.end_ns
        self.duration_ns = end_ns
        self.keys: Counter[str] = sum((Counter(part.keys) for part in self.parts), Counter())

    def log_at(self, place_ns: int) -> int:
        """The log_time of a place."""
        number = self._number(place_ns)
        return self.parts[number].start_ns + place_ns - self._begins_ns[number]

    def read(self, from_ns: int = 0) -> Iterator[PlacedMessage]:
        """Every message from a place on, in the order of writing; places never go back.  Raises UserError."""
        first = self._number(from_ns)
        for number in range(first, len(self.parts)):
            part, begin_ns = self.parts[number], self._begins_ns[number]
            for place_ns, recorded in self._of_part(part, max(0, from_ns - begin_ns) if number == first else 0):
                yield PlacedMessage(begin_ns + place_ns, recorded)

    def last_before(self, place_ns: int, keys: Sequence[str]) -> list[Recorded]:
        """The last message of each of `keys` before a place, in the order of writing.  Raises UserError."""
        last: dict[str, Recorded] = {}
        for number in range(self._number(place_ns) + 1):
            part, left_ns = self.parts[number], place_ns - self._begins_ns[number]
            wanted = [key for key in keys if key in part.keys]
            if not wanted or left_ns <= 0:
                continue
            for recorded in self._state(part, left_ns, wanted):
                last.pop(recorded.topic, None)
                last[recorded.topic] = recorded
        return list(last.values())

    def _number(self, place_ns: int) -> int:
        return max((k for k, begin_ns in enumerate(self._begins_ns) if begin_ns <= place_ns), default=0)

    def _part(self, path: Path) -> PlayedPart:
        try:
            part = _from_summary(path, read_summary(path))
        except OSError:
            part = None  # reading the file decides whether it is a take
        if part is not None:
            return part
        counts: Counter[str] = Counter()
        start_ns = length_ns = 0
        for place_ns, recorded in _places(self._scan(path)):
            if not counts:
                start_ns = recorded.log_ns
            counts[recorded.topic] += 1
            length_ns = place_ns
        return PlayedPart(path, start_ns, start_ns + length_ns, dict(counts))

    def _of_part(self, part: PlayedPart, from_ns: int) -> Iterator[tuple[int, Recorded]]:
        if part.index is None or not from_ns:
            yield from (item for item in _places(self._scan(part.path), part.start_ns) if item[0] >= from_ns)
            return
        yield from _places(self._indexed(part, part.index, part.start_ns + from_ns), part.start_ns)

    def _state(self, part: PlayedPart, before_ns: int, keys: Sequence[str]) -> Iterable[Recorded]:
        """Messages of `keys` before a time, in the order of writing, at least the last one of each."""
        if part.index is not None:
            return self._last_indexed(part, part.index, part.start_ns + before_ns, keys)
        return self._scanned_state(part, before_ns, keys)

    def _scanned_state(self, part: PlayedPart, before_ns: int, keys: Sequence[str]) -> Iterator[Recorded]:
        for place_ns, recorded in _places(self._scan(part.path), part.start_ns):
            if place_ns >= before_ns:
                return
            if recorded.topic in keys:
                yield recorded

    def _scan(self, path: Path) -> Iterator[Recorded]:
        take = TakeReader(path)
        yield from take.messages()
        if take.cut:
            self.lost[path] = take.cut

    def _indexed(self, part: PlayedPart, summary: Summary, from_log_ns: int) -> Iterator[Recorded]:
        """Messages logged from a time on, in the order of writing; one chunk is in memory at a time."""
        with _opened(part.path) as file:
            for chunk in summary.chunks:
                if chunk.message_end_time < from_log_ns:
                    continue
                for message in self._records(part, file, chunk):
                    channel = summary.channels.get(message.channel_id)
                    if channel is not None and message.log_time >= from_log_ns:
                        yield recorded_of(message, channel, summary.schemas)

    def _last_indexed(self, part: PlayedPart, summary: Summary, to_log_ns: int, keys: Sequence[str]) -> list[Recorded]:
        """The last message of each of `keys` logged before a time, in the order of writing; read from the end."""
        missing, found = set(keys), dict[str, tuple[int, int, Recorded]]()
        with _opened(part.path) as file:
            for chunk in reversed(summary.chunks):
                if not missing:
                    break
                topics = {summary.channels[id].topic for id in chunk.message_index_offsets}
                if chunk.message_start_time >= to_log_ns or (topics and not topics & missing):
                    continue
                for number, message in enumerate(self._records(part, file, chunk)):
                    channel = summary.channels.get(message.channel_id)
                    if channel is not None and channel.topic in missing and message.log_time < to_log_ns:
                        recorded = recorded_of(message, channel, summary.schemas)
                        found[channel.topic] = chunk.chunk_start_offset, number, recorded
                missing -= found.keys()
        return [recorded for *_, recorded in sorted(found.values(), key=lambda each: each[:2])]

    def _records(self, part: PlayedPart, file: BinaryIO, chunk: ChunkIndex) -> Sequence[Message]:
        """The messages of a chunk; none of a damaged one, which counts as lost."""
        try:
            return list(chunk_messages(Records(file), chunk))
        except (BrokenChunk, OSError):
            self.lost[part.path] = f"{part.path}: damaged: a chunk lost at byte {chunk.chunk_start_offset}"
            return ()


def _opened(path: Path) -> BinaryIO:
    """Open for reading.  Raises UserError."""
    try:
        return path.open("rb")
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror or error}") from error


def _places(messages: Iterator[Recorded], start_ns: int | None = None) -> Iterator[tuple[int, Recorded]]:
    """Yield places, counted from `start_ns` or the first message.  After a clock that was set back, places continue."""
    latest_ns = 0
    for recorded in messages:
        if start_ns is None:
            start_ns = recorded.log_ns
        place_ns = recorded.log_ns - start_ns
        if place_ns < latest_ns - CLOCK_STEP_NS:
            start_ns = recorded.log_ns - latest_ns
        latest_ns = max(latest_ns, place_ns)
        yield latest_ns, recorded


def _from_summary(path: Path, summary: Summary | None) -> PlayedPart | None:
    """None when the summary is incomplete or contradictory, or the clock was set back."""
    filled = [chunk for chunk in summary.chunks if chunk.message_end_time] if summary is not None else []
    if summary is None or not filled or not _in_order(filled):
        return None
    used = {*summary.counts, *(id for chunk in summary.chunks for id in chunk.message_index_offsets)}
    start_ns, end_ns = min(c.message_start_time for c in filled), max(c.message_end_time for c in filled)
    if (start_ns, end_ns) != (summary.start_ns, summary.end_ns) or not used <= summary.channels.keys():
        return None
    counts: Counter[str] = Counter()
    for id, count in summary.counts.items():
        counts[summary.channels[id].topic] += count
    return PlayedPart(path, start_ns, end_ns, dict(counts), summary)


def _in_order(chunks: Sequence[ChunkIndex]) -> bool:
    """True when chunks in the order of the file are in the order of time, so no clock was set back."""
    return all(after.message_start_time >= before.message_end_time - CLOCK_STEP_NS for before, after in pairwise(chunks))
