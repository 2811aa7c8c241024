"""Content of MCAP records: layouts, records other than messages, and chunks unpacked within bounds."""

import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema

TEXT, LONG = "<I", "<Q"  # bytes preceded by their length, 4 or 8 bytes
LAYOUT: dict[int, tuple[int | str, ...]] = {  # fields of a record by kind, behind which a later version may have more
    Opcode.HEADER: (TEXT, TEXT),
    Opcode.FOOTER: (20,),
    Opcode.SCHEMA: (2, TEXT, TEXT, TEXT),
    Opcode.CHANNEL: (4, TEXT, TEXT, TEXT),
    Opcode.CHUNK: (28, TEXT, LONG),
    Opcode.MESSAGE_INDEX: (2, TEXT),
    Opcode.CHUNK_INDEX: (32, TEXT, 8, TEXT, 16),
    Opcode.ATTACHMENT: (16, TEXT, TEXT, LONG, 4),
    Opcode.ATTACHMENT_INDEX: (40, TEXT, TEXT),
    Opcode.STATISTICS: (42, TEXT),
    Opcode.METADATA: (TEXT, TEXT),
    Opcode.METADATA_INDEX: (16, TEXT),
    Opcode.SUMMARY_OFFSET: (17,),
    Opcode.DATA_END: (4,),
}
HEAD = struct.Struct("<BQ")  # of a record: kind, length
MESSAGE = struct.Struct("<HIQQ")  # before its data: channel, sequence, log and publish time
COMPRESSED, LARGE = "a chunk compressed with ", "a chunk of more than "  # begins of reasons that are no damage
FIXED = struct.Struct("<QQQII")  # first and last log time, uncompressed size, checksum, length of the compression's name
MAX_CHUNK = 64 << 20  # bytes uncompressed; ours have up to 6 MiB, the defaults of other writers are below 64 MiB
OF_INDEX = (  # records that may follow the data
    Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX,
    Opcode.SUMMARY_OFFSET,
)  # fmt: skip


def fields_end(kind: int, start: int, end: int, read: Callable[[int, int], bytes]) -> int | None:
    """Offset behind the fields of LAYOUT, in a record with content from `start` to `end`; None where they do not fit.

    read: the bytes at an offset, a number of them.
    """
    at = start
    for part in LAYOUT[kind]:
        if isinstance(part, int):
            at += part
            continue
        size = struct.calcsize(part)
        number = read(at, size)
        if len(number) < size or at + size > end:
            return None
        at += size + struct.unpack(part, number)[0]
    return at if at <= end else None


class BrokenRecord(Exception):
    """The content does not match its record kind; the text is the reason."""


def decode_record(kind: int, body: bytes) -> Header | Schema | Channel | Metadata | Attachment | None:
    """Decode a record by its kind; None for those of the index.  Raises BrokenRecord, also for a wrong checksum."""
    stream = ReadDataStream(BytesIO(body))
    found: Header | Schema | Channel | Metadata
    try:
        match kind:
            case Opcode.HEADER:
                found = Header.read(stream)
            case Opcode.SCHEMA:
                found = Schema.read(stream)
            case Opcode.CHANNEL:
                found = Channel.read(stream)
            case Opcode.METADATA:
                found = Metadata.read(stream)
            case Opcode.ATTACHMENT:
                return _attachment(body)
            case _:
                return None
    except (McapError, ValueError, struct.error) as error:
        raise BrokenRecord(str(error) or type(error).__name__) from error
    if stream.count != fields_end(kind, 0, len(body), lambda at, size: body[at : at + size]):
        raise BrokenRecord("lengths that do not agree")
    return found


def _attachment(body: bytes) -> Attachment:
    """Decode an attachment.  mcap's own reader takes an empty one for the end of the file and ignores the checksum."""
    log_ns, create_ns = struct.unpack_from("<QQ", body)
    name, at = _text(body, 16)
    media_type, at = _text(body, at)
    end = at + 8 + struct.unpack_from(LONG, body, at)[0]
    (expected,) = struct.unpack_from("<I", body, end)
    if expected and zlib.crc32(memoryview(body)[:end]) != expected:
        raise BrokenRecord("its checksum is wrong")
    return Attachment(create_ns, log_ns, name, media_type, body[at + 8 : end])


def _text(body: bytes, at: int) -> tuple[str, int]:
    end = at + 4 + struct.unpack_from("<I", body, at)[0]
    return body[at + 4 : end].decode(), end


class BrokenChunk(Exception):
    """The chunk has no readable records, or no further ones; the text is the reason."""


def chunk_span(body: bytes) -> tuple[int, int]:
    """First and last log time, ns, from the header of the chunk."""
    first, last, *_ = FIXED.unpack_from(body)
    return first, last


def chunk_records(body: bytes) -> Iterator[Schema | Channel | Message]:
    """The records of a chunk, with valid lengths.  Raises BrokenChunk, usually before the first one."""
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
                found = decode_record(kind, data[start:at])
            except BrokenRecord as error:
                raise BrokenChunk("a chunk with a broken schema or channel") from error
            if isinstance(found, Schema | Channel):
                yield found
        elif kind in LAYOUT:
            raise BrokenChunk(f"a chunk with a record of kind {kind}, which a chunk cannot contain")


def compression_of(body: bytes) -> bytes:
    """Name of the compression of a chunk; b"" for none."""
    *_, name_length = FIXED.unpack_from(body)
    return body[FIXED.size : FIXED.size + name_length]


def _unpacked(body: bytes) -> bytes:
    _, _, size, expected, name_length = FIXED.unpack_from(body)
    packing = compression_of(body)
    at = FIXED.size + name_length + 8
    packed = memoryview(body)[at : at + struct.unpack_from(LONG, body, at - 8)[0]]
    if size > MAX_CHUNK:
        raise BrokenChunk(f"{LARGE}{MAX_CHUNK >> 20} MiB uncompressed, {size >> 20}, which is not read")
    match packing:
        case b"":
            data = bytes(packed)
        case b"zstd":
            data = _unzstd(packed, size)
        case b"lz4":
            data = _unlz4(packed, size)
        case _:
            name = packing[:16].decode(errors="replace")
            raise BrokenChunk(f"{COMPRESSED}{name!r}, which is not read: allowed: zstd, lz4, or none")
    if len(data) != size:
        raise BrokenChunk(f"a chunk of {len(data)} bytes uncompressed instead of {size}")
    if expected and zlib.crc32(data) != expected:
        raise BrokenChunk("a chunk with a wrong checksum")
    return data


def _unlz4(packed: memoryview, size: int) -> bytes:
    """At most `size` + 1 bytes, of one frame or several."""
    try:
        from lz4.frame import LZ4FrameFile  # a dependency of mcap
    except ImportError:
        raise BrokenChunk(f"{COMPRESSED}'lz4', which needs the package lz4: pip install lz4") from None
    try:
        return bytes(LZ4FrameFile(BytesIO(packed)).read(size + 1))
    except (RuntimeError, EOFError, MemoryError) as error:
        raise BrokenChunk("a chunk that cannot be decompressed") from error


def _unzstd(packed: memoryview, size: int) -> bytes:
    """At most `size` + 1 bytes: the size declared in the compressed frame is not used."""
    try:
        decompressor = zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK)
        with decompressor.stream_reader(packed, read_across_frames=True) as stream:
            return stream.read(size + 1)
    except (zstandard.ZstdError, MemoryError) as error:
        raise BrokenChunk("a chunk that cannot be decompressed") from error
