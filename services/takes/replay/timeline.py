"""Takes on one time line: how long they are, which keys they have, and reading them from any place.

A place is in nanoseconds since the beginning of the first take, by log_time.  Takes follow one another; the time between
two, as between the files of one recording, is kept up to LONGEST_GAP_NS.
"""

import logging
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from io import BufferedReader
from itertools import pairwise
from pathlib import Path

from mcap.reader import SeekingReader
from mcap.summary import Summary

from common.take.reading import BROKEN, MAX_RECORD, Recorded, Take

logger = logging.getLogger(__name__)

LONGEST_GAP_NS = 10_000_000_000
SET_BACK_NS = 1_000_000_000  # a log_time that is further back than this comes of a clock that was set


@dataclass(frozen=True)
class Part:
    """One take.  start_ns, end_ns: its first and last log_time.  keys: messages by key.

    indexed: it can be read from any log_time without reading what comes before.
    """

    path: Path
    start_ns: int
    end_ns: int
    keys: dict[str, int]
    indexed: bool


@dataclass(frozen=True)
class Placed:
    """A message and its place."""

    place_ns: int
    recorded: Recorded


class Timeline:
    """The takes, in the order of their beginning.  lost: by take, what reading it again and again found missing."""

    def __init__(self, paths: Sequence[Path]) -> None:
        """Raises TakeError for a file that is no take."""
        self.lost: dict[Path, str] = {}
        self.parts = tuple(sorted(map(self._part, paths), key=lambda part: part.start_ns))
        self._begins_ns: list[int] = []
        end_ns = before_ns = 0
        for number, part in enumerate(self.parts):
            gap_ns = part.start_ns - before_ns if number else 0
            if gap_ns < 0:
                logger.warning("%s begins before the take in front of it has ended: played after that", part.path)
            self._begins_ns.append(end_ns + (gap_ns if 0 <= gap_ns <= LONGEST_GAP_NS else 0))
            end_ns, before_ns = self._begins_ns[-1] + part.end_ns - part.start_ns, part.end_ns
        self.duration_ns = end_ns
        self.keys: Counter[str] = sum((Counter(part.keys) for part in self.parts), Counter())

    def log_at(self, place_ns: int) -> int:
        """The log_time of a place."""
        number = self._number(place_ns)
        return self.parts[number].start_ns + place_ns - self._begins_ns[number]

    def read(self, from_ns: int = 0) -> Iterator[Placed]:
        """Every message from a place on, in the order of writing; places never go back.  Raises TakeError."""
        first = self._number(from_ns)
        for number in range(first, len(self.parts)):
            part, begin_ns = self.parts[number], self._begins_ns[number]
            for place_ns, recorded in self._of_part(part, max(0, from_ns - begin_ns) if number == first else 0):
                yield Placed(begin_ns + place_ns, recorded)

    def last_before(self, place_ns: int, keys: Sequence[str]) -> list[Recorded]:
        """The last message of each of `keys` before a place, in the order of writing.  Raises TakeError."""
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

    def _part(self, path: Path) -> Part:
        summary = _with_reader(path, lambda reader: reader.get_summary())
        if summary is not None and summary.statistics is not None and summary.chunk_indexes:
            counts: Counter[str] = Counter()
            for channel_id, count in summary.statistics.channel_message_counts.items():
                counts[summary.channels[channel_id].topic] += count
            statistics = summary.statistics
            if _in_order(summary):
                return Part(path, statistics.message_start_time, statistics.message_end_time, dict(counts), True)
        counts = Counter()
        start_ns = length_ns = 0
        for place_ns, recorded in _places(self._scan(path)):
            if not counts:
                start_ns = recorded.log_ns
            counts[recorded.topic] += 1
            length_ns = place_ns
        return Part(path, start_ns, start_ns + length_ns, dict(counts), False)

    def _of_part(self, part: Part, from_ns: int) -> Iterator[tuple[int, Recorded]]:
        if not (part.indexed and from_ns):
            yield from (item for item in _places(self._scan(part.path), part.start_ns) if item[0] >= from_ns)
            return
        count = 0
        try:
            with part.path.open("rb") as file:
                for item in _places(_indexed(file, part.start_ns + from_ns, None, None), part.start_ns):
                    count += 1
                    yield item
        except BROKEN as error:  # damaged on the way: what is whole behind it is found by reading everything
            self.lost[part.path] = f"{part.path}: damaged: {error}"
            again = (item for item in _places(self._scan(part.path), part.start_ns) if item[0] >= from_ns)
            yield from (item for number, item in enumerate(again) if number >= count)

    def _state(self, part: Part, before_ns: int, keys: Sequence[str]) -> Iterator[Recorded]:
        if part.indexed:
            try:
                with part.path.open("rb") as file:
                    yield from list(_indexed(file, None, part.start_ns + before_ns, keys))
                return
            except BROKEN as error:
                self.lost[part.path] = f"{part.path}: damaged: {error}"
        for place_ns, recorded in _places(self._scan(part.path), part.start_ns):
            if place_ns >= before_ns:
                return
            if recorded.topic in keys:
                yield recorded

    def _scan(self, path: Path) -> Iterator[Recorded]:
        take = Take(path)
        yield from take.messages()
        if take.cut:
            self.lost[path] = take.cut


def _places(messages: Iterator[Recorded], start_ns: int | None = None) -> Iterator[tuple[int, Recorded]]:
    """Places from `start_ns`, or the first message, on.  A clock that was set back goes on from where it was."""
    latest_ns = 0
    for recorded in messages:
        if start_ns is None:
            start_ns = recorded.log_ns
        place_ns = recorded.log_ns - start_ns
        if place_ns < latest_ns - SET_BACK_NS:
            start_ns = recorded.log_ns - latest_ns
        latest_ns = max(latest_ns, place_ns)
        yield latest_ns, recorded


def _with_reader(path: Path, read: Callable[[SeekingReader], Summary | None]) -> Summary | None:
    """None when the file has no whole summary; whether it is a take at all is told by reading it."""
    try:
        with path.open("rb") as file:
            return read(SeekingReader(file, record_size_limit=MAX_RECORD))
    except (*BROKEN, OSError):
        return None


def _in_order(summary: Summary) -> bool:
    """Whether chunks follow one another in time as they do in the file: no clock was set back."""
    chunks = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
    filled = [chunk for chunk in chunks if chunk.message_end_time]
    return all(after.message_start_time >= before.message_end_time - SET_BACK_NS for before, after in pairwise(filled))


def _indexed(
    file: BufferedReader, starting_at: int | None, ending_before: int | None, keys: Sequence[str] | None
) -> Iterator[Recorded]:
    reader = SeekingReader(file, validate_crcs=True, record_size_limit=MAX_RECORD)
    found = reader.iter_messages(keys, log_time_order=False, starting_at=starting_at, ending_before=ending_before)
    for schema, channel, message in found:
        yield Recorded(
            topic=channel.topic,
            encoding=channel.message_encoding,
            schema=schema.name if schema else "",
            data=message.data,
            log_ns=message.log_time,
            publish_ns=message.publish_time,
            sequence=message.sequence,
        )
