"""The index at the end of a take: what it has and when, without reading the messages.

Time and memory are bounded for any file: a size that a file only claims is never allocated.
"""

import struct
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Message, Metadata, MetadataIndex, Schema, Statistics

from zenocap.common.recording.mcap_content import BrokenChunk, BrokenRecord, chunk_records, decode_record
from zenocap.common.recording.mcap_records import Records
from zenocap.common.topics import Topic, topic_at

MAX_SEARCHED = 8  # chunks that are read for one message; chosen by hand


@dataclass(frozen=True)
class Summary:
    """messages: number.  start_ns, end_ns: log time of the first and the last.  chunks: in the order of the file.

    channels, schemas: by id.  counts: messages by id of the channel.  metadata: places of the records, by name.
    """

    messages: int
    start_ns: int
    end_ns: int
    channels: Mapping[int, Channel]
    schemas: Mapping[int, Schema]
    chunks: tuple[ChunkIndex, ...]
    counts: Mapping[int, int]
    metadata: Mapping[str, int]

    def ids(self, topic: Topic) -> set[int]:
        """Ids of the channels of a topic; empty where the take has none of its messages."""
        return {id for id, channel in self.channels.items() if topic_at(channel.topic) is topic}

    def with_messages(self, topic: Topic) -> tuple[set[int], list[ChunkIndex]]:
        """Ids of the channels of a topic, and the chunks with messages on them, in the order of the file."""
        wanted = self.ids(topic)
        return wanted, [chunk for chunk in self.chunks if wanted & chunk.message_index_offsets.keys()]


def read_summary(path: Path) -> Summary | None:
    """The index of a take; None for a file that is cut, damaged there, or no take.  Raises OSError."""
    with path.open("rb") as file:
        return _summary(Records(file))


def last_message(path: Path, topic: Topic) -> tuple[bytes, Summary] | None:
    """Bytes of the last message of a topic, and the summary; None as `read_summary`, and without such a message.

    Raises OSError.
    """
    with path.open("rb") as file:
        records = Records(file)
        summary = _summary(records)
        if summary is None:
            return None
        wanted, chunks = summary.with_messages(topic)
        for chunk in chunks[: -MAX_SEARCHED - 1 : -1]:
            try:
                if found := [one.data for one in chunk_messages(records, chunk) if one.channel_id in wanted]:
                    return found[-1], summary
            except BrokenChunk:
                return None
    return None


def messages_in(path: Path, chunk: ChunkIndex, wanted: Collection[int]) -> list[bytes]:
    """Bytes of the messages of a chunk on the channels of these ids, in the order of writing; of a damaged one those before
    the damage.  Raises OSError."""
    found: list[bytes] = []
    with path.open("rb") as file, suppress(BrokenChunk):
        found.extend(one.data for one in chunk_messages(Records(file), chunk) if one.channel_id in wanted)
    return found


def chunk_messages(records: Records, chunk: ChunkIndex) -> Iterator[Message]:
    """Messages of a chunk, in the order of writing.  Raises BrokenChunk, also where the file has none at its place."""
    body = records.body_at(chunk.chunk_start_offset, Opcode.CHUNK)
    if body is None:
        raise BrokenChunk("no chunk where the index has one")
    return (item for item in chunk_records(body) if isinstance(item, Message))


def metadata_of(path: Path, summary: Summary) -> dict[str, dict[str, str]]:
    """Metadata of a take by name, read through its index; without those that are damaged.  Raises OSError."""
    found = {}
    with path.open("rb") as file:
        records = Records(file)
        for name, offset in summary.metadata.items():
            body = records.body_at(offset, Opcode.METADATA)
            with suppress(BrokenRecord):
                record = decode_record(Opcode.METADATA, body) if body is not None else None
                if isinstance(record, Metadata):
                    found[name] = record.metadata
    return found


def _summary(records: Records) -> Summary | None:
    statistics: Statistics | None = None
    metadata: dict[str, int] = {}
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    chunks: list[ChunkIndex] = []
    try:
        for kind, body in records.summary():
            stream = ReadDataStream(BytesIO(body))
            match kind:
                case Opcode.STATISTICS:
                    statistics = Statistics.read(stream)
                case Opcode.CHUNK_INDEX:
                    chunks.append(ChunkIndex.read(stream))
                case Opcode.METADATA_INDEX:
                    place = MetadataIndex.read(stream)
                    metadata[place.name] = place.offset
                case Opcode.CHANNEL | Opcode.SCHEMA:
                    match decode_record(kind, body):
                        case Channel() as channel:
                            channels[channel.id] = channel
                        case Schema() as schema:
                            schemas[schema.id] = schema
                case _:
                    pass
    except (BrokenRecord, McapError, ValueError, struct.error):
        return None
    if statistics is None:
        return None
    chunks.sort(key=lambda chunk: chunk.chunk_start_offset)
    return Summary(
        statistics.message_count, statistics.message_start_time, statistics.message_end_time, channels, schemas,
        tuple(chunks), statistics.channel_message_counts, metadata,
    )  # fmt: skip
