"""The content of one record of an MCAP file that is no chunk and no message."""

import struct
import zlib
from io import BytesIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema


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
