"""Reading a take, also one that was cut by a crash or damaged: everything that is whole, and what was lost."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BufferedReader
from pathlib import Path

import zstandard
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Footer, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from common import codec
from common.bus.protocol import Envelope
from common.topics import topic_at

# What mcap lets through when bytes are missing or wrong.
BROKEN = (McapError, struct.error, zstandard.ZstdError, ValueError, KeyError, OverflowError, MemoryError)
MAX_RECORD = 256 << 20  # bytes; longer ones are damage


class TakeError(Exception):
    """The file is no take at all; the text says which and why."""


@dataclass(frozen=True)
class Recorded:
    """One message of a take, not decoded.  topic: its key.  schema: name of its schema, "" for none."""

    topic: str
    encoding: str
    schema: str
    data: bytes
    log_ns: int
    publish_ns: int
    sequence: int


@dataclass
class Take:
    """A file's messages in the order of writing.  The other fields are complete when `messages` has ended.

    cut: what is missing, None for a whole file.
    """

    path: Path
    cut: str | None = None
    library: str = ""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)

    def messages(self) -> Iterator[Recorded]:
        """Raises TakeError when the file cannot be opened or is no MCAP file; damage ends in `cut` instead."""
        try:
            file = self.path.open("rb")
        except OSError as error:
            raise TakeError(f"{self.path} cannot be read: {error.strerror or error}") from error
        with file:
            yield from self._read(file)

    def _read(self, file: BufferedReader) -> Iterator[Recorded]:
        self.cut = None
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        count = damaged = 0
        finished = False
        records = iter(StreamReader(file, emit_chunks=True, record_size_limit=MAX_RECORD).records)
        while True:
            try:
                record = next(records)
                finished = finished or isinstance(record, Footer)
            except StopIteration:
                break
            except BROKEN as error:
                if file.tell() <= 8:
                    raise TakeError(f"{self.path} is no MCAP file") from error
                break
            try:
                inner = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
            except BROKEN:
                damaged += 1
                continue
            for whole in inner:
                match whole:
                    case Schema():
                        schemas[whole.id] = whole
                    case Channel():
                        channels[whole.id] = whole
                    case Message() if whole.channel_id in channels:
                        count += 1
                        yield _recorded(whole, channels[whole.channel_id], schemas)
                    case Message():
                        damaged += 1
                    case _:
                        self._keep(whole)
        if damaged:
            self.cut = f"{self.path}: damaged: {damaged} chunks or messages lost, {count} messages read"
        elif not finished:
            self.cut = f"{self.path}: cut before its end, {count} messages read"

    def _keep(self, record: McapRecord) -> None:
        match record:
            case Metadata(name=name, metadata=values):
                self.metadata[name] = values
            case Attachment(name=name, data=data):
                self.attachments[name] = data
            case _:
                self.library = getattr(record, "library", self.library)


def envelope(recorded: Recorded) -> Envelope | None:
    """The message of a recorded key of ours, as it was received; None for channels of others.  Raises BadMessage."""
    topic = topic_at(recorded.topic)
    if topic is None or recorded.encoding != "msgpack":
        return None
    message = codec.decode(recorded.data, topic.message)
    return Envelope(recorded.topic, topic, message, recorded.log_ns, recorded.data)


def _recorded(message: Message, channel: Channel, schemas: dict[int, Schema]) -> Recorded:
    schema = schemas.get(channel.schema_id)
    return Recorded(
        topic=channel.topic,
        encoding=channel.message_encoding,
        schema=schema.name if schema else "",
        data=message.data,
        log_ns=message.log_time,
        publish_ns=message.publish_time,
        sequence=message.sequence,
    )
