"""What records of an MCAP file are made of, and the content of one that is no chunk and no message."""

import struct
import zlib
from io import BytesIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema

TEXT, LONG = "<I", "<Q"  # bytes after their number, of 4 or 8 bytes
LAYOUT: dict[int, tuple[int | str, ...]] = {  # sizes of what a record is made of, which fill it exactly
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
OF_INDEX = (  # what may follow the data
    Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX,
    Opcode.SUMMARY_OFFSET,
)  # fmt: skip


class BrokenRecord(Exception):
    """The content is none of its kind; the text says why."""


def whole_record(kind: int, body: bytes) -> Header | Schema | Channel | Metadata | Attachment | None:
    """A record by its kind; None for those of the index.  Raises BrokenRecord, for a wrong sum too."""
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
    if stream.count != len(body):
        raise BrokenRecord("lengths that do not fit")
    return found


def _attachment(body: bytes) -> Attachment:
    """mcap's own reader takes an empty one for the end of the file, and checks no sum."""
    (expected,) = struct.unpack("<I", body[-4:])
    if expected and zlib.crc32(memoryview(body)[:-4]) != expected:
        raise BrokenRecord("its sum is wrong")
    log_ns, create_ns = struct.unpack_from("<QQ", body)
    name, at = _text(body, 16)
    media_type, at = _text(body, at)
    return Attachment(create_ns, log_ns, name, media_type, body[at + 8 : -4])


def _text(body: bytes, at: int) -> tuple[str, int]:
    end = at + 4 + struct.unpack_from("<I", body, at)[0]
    return body[at + 4 : end].decode(), end
