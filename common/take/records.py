"""The records of an MCAP file, one after another, also of a file that is cut, damaged or hostile.

What is whole is read; what is not becomes a `Damage`, after which reading goes on at the next record.  A record is
believed when its own length and the lengths inside it agree.  Nothing is trusted with memory: records, chunks and
what they unpack to are bounded.  Sums over chunks, attachments, all data and the index are checked.
"""

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import SEEK_END
from typing import BinaryIO, TypeAlias

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema

from common.take.chunks import MAX_CHUNK, BrokenChunk, chunk_records, chunk_span
from common.take.contents import LAYOUT, OF_INDEX, BrokenRecord, whole_record

MAGIC = b"\x89MCAP0\r\n"
MAX_RECORD = 256 << 20  # bytes; longer ones are damage
HEAD = struct.Struct("<BQ")
NEAR, WINDOW = 512, 1 << 20  # bytes searched at once: at first, as records may follow often, and at most

RECORD_START = re.compile(rb"[\x01-\x0f](?=.{4}\0{4})", re.DOTALL)  # a kind and a length below 4 GiB


class NotMcap(Exception):
    """Neither the beginning of an MCAP file nor any record of one."""


@dataclass(frozen=True)
class Damage:
    """length: bytes of the file from `offset` on that give nothing; 0 where something is missing or does not add up.

    chunk: it is one whole chunk, of messages logged between span_ns.  index: after the data, where no message is.
    """

    offset: int
    length: int
    why: str
    chunk: bool = False
    span_ns: tuple[int, int] | None = None
    index: bool = False


@dataclass(frozen=True)
class ChunkEnd:
    """What came since the last one was one chunk."""


Item: TypeAlias = Header | Schema | Channel | Message | Metadata | Attachment | ChunkEnd | Damage


class Records:
    """The records of an open file from its beginning, in their order, without indexes.

    Schemas and channels come first from an index that is whole, so that they outlive the chunk that had them.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = file.seek(0, SEEK_END)
        self._chunked = False
        self._sound = True  # no damage so far: the sums over many records can be checked
        self._sum = 0
        self._index_at: int | None = None  # where the data ended

    def __iter__(self) -> Iterator[Item]:
        """Raises NotMcap before the first item, and OSError."""
        offset = len(MAGIC)
        if self._at(0, offset) != MAGIC:
            offset = self._next_record(0)
            if offset >= self._size:
                raise NotMcap
            yield self._damage(0, offset, "the mark at its beginning is wrong")
        yield from self._index()
        self._sum = zlib.crc32(MAGIC)
        while offset < self._size:
            shape = self._shape(offset)
            if shape is None:
                after = self._next_record(offset + 1)
                yield self._damage(offset, after - offset, "cut within a record" if after == self._size else "no record")
                if after == self._size:
                    return
                offset = after
                continue
            kind, end = shape
            head, body = self._at(offset, HEAD.size), self._at(offset + HEAD.size, end - offset - HEAD.size)
            yield from self._record(offset, kind, head, body)
            offset = end
            if kind == Opcode.FOOTER:
                if self._at(end, len(MAGIC) + 1) != MAGIC:
                    yield self._damage(end, self._size - end, "the mark at its end is wrong")
                return
        yield Damage(self._size, 0, "cut before its end", index=self._index_at is not None)

    def _record(self, offset: int, kind: int, head: bytes, body: bytes) -> Iterator[Item]:
        if kind == Opcode.DATA_END:
            (expected,) = struct.unpack("<I", body)
            if self._sound and expected and expected != self._sum:
                yield self._damage(offset, 0, "the sum over its data is wrong: an index, metadata or a name was changed")
            self._index_at, self._sum = offset + len(head) + len(body), 0
            return
        if kind == Opcode.FOOTER:
            yield from self._footer(offset, head, body)
            return
        if self._index_at is not None and kind not in OF_INDEX:
            self._index_at = None  # that was not the end of the data
            yield self._damage(offset, 0, "data after the end of its data")
        self._sum = zlib.crc32(body, zlib.crc32(head, self._sum))
        whole = len(head) + len(body)
        match kind:
            case Opcode.CHUNK:
                self._chunked = True
                try:
                    yield from chunk_records(body)
                except BrokenChunk as error:
                    yield self._damage(offset, whole, str(error), chunk=True, span_ns=chunk_span(body))
                else:
                    yield ChunkEnd()
            case Opcode.MESSAGE if len(body) >= 22:
                channel_id, sequence, log_ns, publish_ns = struct.unpack_from("<HIQQ", body)
                yield Message(channel_id, log_ns, body[22:], publish_ns, sequence)
            case _:
                try:
                    found = whole_record(kind, body)
                except BrokenRecord:
                    yield self._damage(offset, whole, f"a broken {Opcode(kind).name.lower().replace('_', ' ')}")
                else:
                    if found is not None:
                        yield found

    def _footer(self, offset: int, head: bytes, body: bytes) -> Iterator[Damage]:
        start, _, expected = struct.unpack("<QQI", body)
        if self._index_at is None:
            yield self._damage(offset, 0, "the end of its data is not marked")
        elif self._sound and start and start != self._index_at:
            yield self._damage(offset, 0, "its index is not where it says")
        elif self._sound and expected and zlib.crc32(head + body[:16], self._sum) != expected:
            yield self._damage(offset, 0, "the sum over its index is wrong")

    def _index(self) -> Iterator[Schema | Channel]:
        """The schemas and channels of an index that is whole."""
        tail = self._at(max(0, self._size - 37), 37)
        if len(tail) != 37 or tail[29:] != MAGIC or tail[:9] != HEAD.pack(Opcode.FOOTER, 20):
            return
        start, offsets, expected = struct.unpack("<QQI", tail[9:29])
        footer = self._size - 37
        # Where it says; or where it must have been moved to when bytes before it are missing or too many, which follows
        # from its length: what lies between both starts, and some offsets of 26 bytes.
        places = [start, *(footer - 26 * count - (offsets - start) for count in range(8) if offsets >= start)]
        for start in places:
            if 0 < start < footer and footer - start <= MAX_CHUNK:
                summary = self._at(start, footer - start)
                if zlib.crc32(tail[:25], zlib.crc32(summary)) == expected:
                    break
        else:
            return
        offset = start
        while (shape := self._shape(offset)) is not None and shape[0] != Opcode.FOOTER:
            kind, end = shape
            if kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                try:
                    found = whole_record(kind, summary[offset + HEAD.size - start : end - start])
                except BrokenRecord:
                    return
                if isinstance(found, Schema | Channel):
                    yield found
            offset = end

    def _damage(
        self, offset: int, length: int, why: str, *, chunk: bool = False, span_ns: tuple[int, int] | None = None
    ) -> Damage:
        self._sound = False
        return Damage(offset, length, why, chunk, span_ns, index=self._index_at is not None)

    def _shape(self, offset: int) -> tuple[int, int] | None:
        """Kind and end of the record at `offset`; None when there is none.

        A message has no lengths inside: it is believed where messages stand outside of chunks, and a record follows.
        """
        found = self._fitting(offset)
        if found is None or found[0] != Opcode.MESSAGE:
            return found
        if self._chunked:
            return None
        head = self._at(found[1], HEAD.size)
        if len(head) < HEAD.size or self._fitting(found[1]):
            return found
        kind, length = HEAD.unpack(head)
        cut = kind in (Opcode.MESSAGE, *LAYOUT) and self._size - found[1] - HEAD.size < length <= MAX_RECORD
        return found if cut else None

    def _fitting(self, offset: int) -> tuple[int, int] | None:
        """The same by the lengths of the record alone."""
        head = self._at(offset, HEAD.size)
        if len(head) < HEAD.size:
            return None
        kind, length = HEAD.unpack(head)
        start, end = offset + HEAD.size, offset + HEAD.size + length
        if end > self._size or length > MAX_RECORD:
            return None
        if kind == Opcode.MESSAGE:
            return (kind, end) if length >= 22 else None
        at = start
        for part in LAYOUT.get(kind, (-1,)):
            if isinstance(part, int):
                at += part
            else:
                size = struct.calcsize(part)
                number = self._at(at, size)
                if len(number) < size or at + size > end:
                    return None
                at += size + struct.unpack(part, number)[0]
        return (kind, end) if at == end else None

    def _next_record(self, offset: int) -> int:
        """Where the next record begins, from `offset` on; the file's size when none does."""
        length = NEAR
        while offset < self._size:
            for found in RECORD_START.finditer(self._at(offset, length + HEAD.size)):
                if self._shape(offset + found.start()):
                    return offset + found.start()
            offset += length
            length = min(2 * length, WINDOW)
        return self._size

    def _at(self, offset: int, length: int) -> bytes:
        self._file.seek(offset)
        return self._file.read(length)
