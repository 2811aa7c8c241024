"""A chunk of an MCAP file: unpacked within bounds, its sum checked, its records one by one."""

import struct
import zlib
from collections.abc import Iterator

import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Schema

from common.take.contents import BrokenRecord, whole_record

MAX_CHUNK = 64 << 20  # bytes unpacked; ours have up to 6 MiB, the defaults of other writers are below that
FIXED = struct.Struct("<QQQII")  # first and last log time, size unpacked, sum, length of the name of the packing
HEAD = struct.Struct("<BQ")
MESSAGE = struct.Struct("<HIQQ")


class BrokenChunk(Exception):
    """The chunk gives nothing, or nothing more; the text says why."""


def chunk_span(body: bytes) -> tuple[int, int]:
    """First and last log time, ns, as the chunk's own record says."""
    first, last, *_ = FIXED.unpack_from(body)
    return first, last


def chunk_records(body: bytes) -> Iterator[Schema | Channel | Message]:
    """The records of a chunk, whose lengths are known to fit.  Raises BrokenChunk, mostly before the first one."""
    data = _unpacked(body)
    at, end = 0, len(data)
    while at < end:
        if at + HEAD.size > end:
            raise BrokenChunk("a chunk with a record cut short")
        kind, length = HEAD.unpack_from(data, at)
        start, at = at + HEAD.size, at + HEAD.size + length
        if at > end:
            raise BrokenChunk("a chunk with a record cut short")
        if kind == Opcode.MESSAGE:
            if length < MESSAGE.size:
                raise BrokenChunk("a chunk with a message cut short")
            channel_id, sequence, log_ns, publish_ns = MESSAGE.unpack_from(data, start)
            yield Message(channel_id, log_ns, data[start + MESSAGE.size : at], publish_ns, sequence)
        elif kind in (Opcode.SCHEMA, Opcode.CHANNEL):
            try:
                found = whole_record(kind, data[start:at])
            except BrokenRecord as error:
                raise BrokenChunk("a chunk with a broken schema or channel") from error
            if isinstance(found, Schema | Channel):
                yield found
        else:
            raise BrokenChunk(f"a chunk with a record of kind {kind}, which belongs into none")


def _unpacked(body: bytes) -> bytes:
    _, _, size, expected, name_length = FIXED.unpack_from(body)
    packing = body[FIXED.size : FIXED.size + name_length]
    packed = memoryview(body)[FIXED.size + name_length + 8 :]
    if size > MAX_CHUNK:
        raise BrokenChunk(f"a chunk of {size} bytes unpacked, more than {MAX_CHUNK}")
    match packing:
        case b"":
            data = bytes(packed)
        case b"zstd":
            data = _unzstd(packed, size)
        case _:
            raise BrokenChunk(f"a chunk packed with {packing[:16]!r}: allowed: zstd, or nothing")
    if len(data) != size:
        raise BrokenChunk(f"a chunk of {len(data)} bytes unpacked instead of {size}")
    if expected and zlib.crc32(data) != expected:
        raise BrokenChunk("a chunk whose sum is wrong")
    return data


def _unzstd(packed: memoryview, size: int) -> bytes:
    """At most `size` bytes and one: what a frame says of itself is not believed."""
    try:
        with zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK).stream_reader(packed) as stream:
            return stream.read(size + 1)
    except (zstandard.ZstdError, MemoryError) as error:
        raise BrokenChunk("a chunk that does not unpack") from error
