"""The records of an MCAP file in order, also of a truncated, damaged or malicious file.

Intact records are read; the others become a `Damage`, after which reading continues at the next record.  A record is
accepted when its length agrees with the lengths inside it.  The sizes of records, chunks and uncompressed data are
bounded.  Checksums of chunks, attachments, all data and the index are verified.
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

from zenocap.common.recording.mcap_content import (
    HEAD,
    LAYOUT,
    MAX_CHUNK,
    MESSAGE,
    OF_INDEX,
    BrokenChunk,
    BrokenRecord,
    chunk_records,
    chunk_span,
    compression_of,
    decode_record,
    fields_end,
)

MAGIC = b"\x89MCAP0\r\n"
MOST_FOREIGN = 16  # records of other programs in a row that are skipped; chosen by hand
EXACT = (0, Opcode.MESSAGE)  # kinds of no record, or without further fields
SMALLEST_CHUNK = 40  # bytes of its content, where there is nothing in it
MAX_RECORD = 256 << 20  # bytes; longer records are damage
NEAR, WINDOW = 512, 1 << 20  # bytes searched at once: first (records are often close together), and at most

RECORD_START = re.compile(rb"[\x01-\x0f](?=.{4}\0{4})", re.DOTALL)  # record kind and a length below 4 GiB


class NotMcap(Exception):
    """The file has neither the beginning of an MCAP file nor any record of one."""


@dataclass(frozen=True)
class Damage:
    """length: unreadable bytes of the file from `offset` on; 0 for missing data or a wrong checksum.  why: for display.

    span_ns: of one whole chunk, log times of its messages.  index: it is after the data, where no message is.
    cut: the file ends here, before its end record.
    """

    offset: int
    length: int
    why: str
    span_ns: tuple[int, int] | None = None
    index: bool = False
    cut: bool = False

    @property
    def chunk(self) -> bool:
        """Whether it is one whole chunk."""
        return self.span_ns is not None


@dataclass(frozen=True)
class ChunkEnd:
    """End of a chunk: the items since the last one belong to it.  compression: its name, "none" without."""

    compression: str


Item: TypeAlias = Header | Schema | Channel | Message | Metadata | Attachment | ChunkEnd | Damage


class Records:
    """The records of an open file from its beginning, in the order of the file, without indexes.

    Schemas and channels of an intact index come first, so that they are available when their chunk is damaged.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = file.seek(0, SEEK_END)
        self._chunked = False
        self._intact = True  # no damage so far: the checksums over many records can be verified
        self._checksum = 0
        self._index_at: int | None = None  # offset of the end of the data

    def __iter__(self) -> Iterator[Item]:
        """Iterate over the items.  Raises NotMcap before the first item, and OSError."""
        offset = len(MAGIC)
        if self._read_at(0, offset) != MAGIC:
            offset = self._next_record(0)
            if offset >= self._size:
                raise NotMcap
            yield self._damage(0, offset, "the magic bytes at its beginning are wrong")
        yield from self._index()
        self._checksum = zlib.crc32(MAGIC)
        while offset < self._size:
            record = self._next_at(offset)
            if record is None:
                after = self._next_record(offset + 1)
                if after == self._size:
                    yield self._damage(offset, after - offset, "cut within a record", cut=True)
                    return
                yield self._damage(offset, after - offset, "no record")
                offset = after
                continue
            kind, end = record
            head, body = self._read_at(offset, HEAD.size), self._read_at(offset + HEAD.size, end - offset - HEAD.size)
            yield from self._record(offset, kind, head, body)
            offset = end
            if kind == Opcode.FOOTER:
                if self._read_at(end, len(MAGIC) + 1) != MAGIC:
                    yield self._damage(end, self._size - end, "the magic bytes at its end are wrong")
                return
        yield Damage(self._size, 0, "cut before its end", index=self._index_at is not None, cut=True)

    def _record(self, offset: int, kind: int, head: bytes, body: bytes) -> Iterator[Item]:
        if kind == Opcode.DATA_END:
            (expected,) = struct.unpack_from("<I", body)
            if self._intact and expected and expected != self._checksum:
                yield self._damage(offset, 0, "the checksum of its data is wrong: an index, metadata or a name was changed")
            self._index_at, self._checksum = offset + len(head) + len(body), 0
            return
        if kind == Opcode.FOOTER:
            yield from self._footer(offset, head, body)
            return
        if self._index_at is not None and kind in LAYOUT and kind not in OF_INDEX:
            self._index_at = None  # it was not the end of the data
            yield self._damage(offset, 0, "data after its data end record")
        self._checksum = zlib.crc32(body, zlib.crc32(head, self._checksum))
        length = len(head) + len(body)
        match kind:
            case Opcode.CHUNK:
                self._chunked = True
                try:
                    yield from chunk_records(body)
                except BrokenChunk as error:
                    yield self._damage(offset, length, str(error), span_ns=chunk_span(body))
                else:
                    yield ChunkEnd(compression_of(body).decode() or "none")
            case Opcode.MESSAGE if len(body) >= MESSAGE.size:
                channel_id, sequence, log_ns, publish_ns = MESSAGE.unpack_from(body)
                yield Message(channel_id, log_ns, body[MESSAGE.size :], publish_ns, sequence)
            case _:
                try:
                    found = decode_record(kind, body)
                except BrokenRecord:
                    yield self._damage(offset, length, f"a broken {Opcode(kind).name.lower().replace('_', ' ')}")
                else:
                    if found is not None:
                        yield found

    def _footer(self, offset: int, head: bytes, body: bytes) -> Iterator[Damage]:
        start, _, expected = struct.unpack_from("<QQI", body)
        if self._index_at is None:
            yield self._damage(offset, 0, "its data end record is missing")
        elif self._intact and start and start != self._index_at:
            yield self._damage(offset, 0, "its index is not at the stated offset")
        elif self._intact and expected and zlib.crc32(head + body[:16], self._checksum) != expected:
            yield self._damage(offset, 0, "the checksum of its index is wrong")

    def body_at(self, offset: int, kind: int) -> bytes | None:
        """Content of the record of a kind at `offset`; None when there is no such record."""
        record = self._record_by_lengths(offset) or self._foreign_at(offset)
        if record is None or record[0] != kind:
            return None
        return self._read_at(offset + HEAD.size, record[1] - offset - HEAD.size)

    def _index(self) -> Iterator[Schema | Channel]:
        """The schemas and channels of an intact index."""
        for kind, body in self.summary():
            if kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                try:
                    found = decode_record(kind, body)
                except BrokenRecord:
                    return
                if isinstance(found, Schema | Channel):
                    yield found

    def summary(self) -> Iterator[tuple[int, bytes]]:
        """Kind and content of the records of an intact index; none of another."""
        tail = self._read_at(max(0, self._size - 37), 37)
        if len(tail) != 37 or tail[29:] != MAGIC or tail[:9] != HEAD.pack(Opcode.FOOTER, 20):
            return
        start, offsets, expected = struct.unpack("<QQI", tail[9:29])
        footer = self._size - 37
        # At its declared offset.  Or, when bytes before it are missing or inserted, at the offset that follows from its
        # length: the bytes between both starts, and summary offsets of 26 bytes each.
        places = [start, *(footer - 26 * count - (offsets - start) for count in range(8) if offsets >= start)]
        for start in places:
            if 0 < start < footer and footer - start <= MAX_CHUNK:
                summary = self._read_at(start, footer - start)
                if zlib.crc32(tail[:25], zlib.crc32(summary)) == expected:
                    break
        else:
            return
        offset = start
        while (record := self._next_at(offset)) is not None and record[0] != Opcode.FOOTER:
            kind, end = record
            yield kind, summary[offset + HEAD.size - start : end - start]
            offset = end

    def _damage(
        self, offset: int, length: int, why: str, *, span_ns: tuple[int, int] | None = None, cut: bool = False
    ) -> Damage:
        """span_ns: of a chunk."""
        self._intact = False
        return Damage(offset, length, why, span_ns, index=self._index_at is not None, cut=cut)

    def _next_at(self, offset: int) -> tuple[int, int] | None:
        """Kind and end of the record at `offset`, where the one before it ends; None when there is none."""
        return self._record_at(offset, searched=False) or self._foreign_at(offset)

    def _record_at(self, offset: int, *, searched: bool = True) -> tuple[int, int] | None:
        """Kind and end of the record at `offset`; None when there is none.

        A message has no lengths inside: it is accepted where a record follows.  searched: the offset is that of any byte,
        such as one in a broken chunk, where no message is accepted once there are chunks.
        """
        found = self._record_by_lengths(offset)
        if found is None or found[0] != Opcode.MESSAGE:
            return found
        if self._chunked and searched:
            return None
        head = self._read_at(found[1], HEAD.size)
        if len(head) < HEAD.size or self._record_by_lengths(found[1]) or self._foreign_at(found[1]):
            return found
        kind, length = HEAD.unpack(head)
        cut = kind in (Opcode.MESSAGE, *LAYOUT) and self._size - found[1] - HEAD.size < length <= MAX_RECORD
        return found if cut else None

    def _record_by_lengths(self, offset: int) -> tuple[int, int] | None:
        """Kind and end of the record, from the lengths of the record alone."""
        if (found := self._extent(offset)) is None:
            return None
        kind, start, end = found
        if kind == Opcode.MESSAGE:
            return (kind, end) if end - start >= MESSAGE.size else None
        return (kind, end) if kind in LAYOUT and fields_end(kind, start, end, self._read_at) == end else None

    def _foreign_at(self, offset: int) -> tuple[int, int] | None:
        """Kind and end of a record of a later version or another program: with more fields, or of a kind that is skipped.

        Accepted where a record of this version follows, or MOST_FOREIGN others and then one.
        """
        first: tuple[int, int] | None = None
        for _ in range(MOST_FOREIGN):
            if (found := self._extent(offset)) is None:
                return None
            kind, start, end = found
            if kind in EXACT or not self._may_be_foreign(kind, start, end):
                return None
            first = first or (kind, end)
            if self._record_by_lengths(end) or (kind == Opcode.FOOTER and self._read_at(end, len(MAGIC) + 1) == MAGIC):
                return first
            offset = end
        return None

    def _may_be_foreign(self, kind: int, start: int, end: int) -> bool:
        """Whether content has the fields of its kind, or none of a chunk or attachment whose kind is damaged."""
        if kind in LAYOUT:
            return fields_end(kind, start, end, self._read_at) is not None
        damaged = (fields_end(one, start, end, self._read_at) == end for one in (Opcode.CHUNK, Opcode.ATTACHMENT))
        return end - start <= SMALLEST_CHUNK or not any(damaged)

    def _extent(self, offset: int) -> tuple[int, int, int] | None:
        """Kind of the record at `offset`, begin and end of its content, from its head alone; None beyond the bounds."""
        head = self._read_at(offset, HEAD.size)
        if len(head) < HEAD.size:
            return None
        kind, length = HEAD.unpack(head)
        start = offset + HEAD.size
        return None if start + length > self._size or length > MAX_RECORD else (kind, start, start + length)

    def _next_record(self, offset: int) -> int:
        """Offset of the next record at or after `offset`; the size of the file when there is none."""
        length = NEAR
        while offset < self._size:
            for found in RECORD_START.finditer(self._read_at(offset, length + HEAD.size)):
                if self._record_at(offset + found.start()):
                    return offset + found.start()
            offset += length
            length = min(2 * length, WINDOW)
        return self._size

    def _read_at(self, offset: int, length: int) -> bytes:
        self._file.seek(offset)
        return self._file.read(length)
