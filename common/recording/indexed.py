"""Messages of some keys of a take, read through its index: chunks without them are not read."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Message

from zenocap.common.recording.mcap_content import BrokenChunk, chunk_records
from zenocap.common.recording.mcap_records import Records
from zenocap.common.recording.reader import Recorded, recorded_of
from zenocap.common.recording.summary import Summary


@dataclass(frozen=True)
class IndexedMessages:
    """chunks: those with a wanted message, in the order of the file.  channels: the wanted ones, by id."""

    path: Path
    chunks: tuple[ChunkIndex, ...]
    channels: dict[int, Channel]

    def of(self, chunk: ChunkIndex) -> list[Recorded]:
        """The wanted messages of a chunk in the order of writing, without schema; of a damaged one those before the damage.

        Raises OSError.
        """
        found: list[Recorded] = []
        with self.path.open("rb") as file:
            body = Records(file).body_at(chunk.chunk_start_offset, Opcode.CHUNK)
        try:
            for item in chunk_records(body) if body is not None else ():
                if isinstance(item, Message) and item.channel_id in self.channels:
                    found.append(recorded_of(item, self.channels[item.channel_id], {}))
        except BrokenChunk:
            pass
        return found


def indexed_messages(path: Path, summary: Summary, is_wanted: Callable[[Channel], bool]) -> IndexedMessages:
    """summary: of the take."""
    channels = {id: channel for id, channel in summary.channels.items() if is_wanted(channel)}
    chunks = [chunk for chunk in summary.chunks if channels.keys() & chunk.message_index_offsets.keys()]
    return IndexedMessages(path, tuple(sorted(chunks, key=lambda chunk: chunk.chunk_start_offset)), channels)
