"""`zenocap recover`: intact content of a cut or damaged take, in a new file."""

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from io import BufferedWriter
from pathlib import Path
from typing import TypeAlias

import zstandard
from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema
from mcap.writer import Writer

from zenocap.common.errors import UserError
from zenocap.common.recording.mcap_records import ChunkEnd, Damage
from zenocap.common.recording.reader import UnreadableParts, items_of
from zenocap.common.recording.writer import LIBRARY, RecordingError

MAX_GAPS = 1000  # listed one by one
MAX_LINES = 20
ChannelKey: TypeAlias = tuple[str, str, str, str, bytes, tuple[tuple[str, str], ...]]


@dataclass(frozen=True)
class UnreadableRange:
    """An unreadable range of bytes.  before_ns, after_ns: log times of the messages around it; None where there is none."""

    offset: int
    bytes: int
    why: str
    before_ns: int | None
    after_ns: int | None


@dataclass
class Recovered:
    """Content written to `output`, and losses."""

    path: Path
    output: Path
    messages: int = 0
    bytes: int = 0
    attachments: int = 0
    start_ns: int | None = None
    end_ns: int | None = None
    losses: UnreadableParts = field(default_factory=UnreadableParts)
    gaps: list[UnreadableRange] = field(default_factory=list)

    @property
    def lost(self) -> bool:
        """True when content other than the index, which is rebuilt, is missing."""
        return self.losses.data


def recover(path: Path, output: Path, watch: Callable[[int], None] = lambda _: None) -> Recovered:
    """Copy the intact content of `path` to the new file `output`; order, times and bytes are unchanged.

    An intact take is copied byte for byte; others get metadata `recovered` that lists the losses.
    watch: is called with the number of bytes read.  Raises UserError when there is nothing to recover,
    and RecordingError when `output` exists or cannot be written; then it is removed.
    """
    recovered = Recovered(path, output)
    with suppress(OSError):
        if output.samefile(path):
            raise RecordingError(f"{output} is the take itself: allowed: another file")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        file = output.open("xb")
    except FileExistsError:
        if not output.exists():
            raise RecordingError(f"{output} cannot be written: {output.parent} is no folder") from None
        raise RecordingError(f"{output} exists already; choose another name or remove it") from None
    except OSError as error:
        raise RecordingError(f"{output} cannot be written: {error.strerror or error}") from error
    kept = False
    try:
        with file:
            _Rewriter(file, recovered).run(watch)
        if not recovered.messages and (recovered.lost or not recovered.attachments):
            why = f": {recovered.gaps[0].why}" if recovered.gaps else ""
            raise UserError(f"{path}: nothing to recover: it contains no intact message{why}")
        kept = True
    except (OSError, zstandard.ZstdError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordingError(f"{output} cannot be written: {reason}") from error
    finally:
        if not kept:
            output.unlink(missing_ok=True)
    return recovered


def loss_lines(recovered: Recovered) -> list[str]:
    """Losses, one line each, of at most MAX_LINES gaps."""
    losses = recovered.losses
    if not losses:
        return []
    if not recovered.lost:
        return ["its index was missing or damaged and was rebuilt; nothing is lost"]
    total = f"lost: {losses.description(recovered.messages)}"
    lines = [total, *(_gap_line(gap) for gap in recovered.gaps[:MAX_LINES])]
    if len(recovered.gaps) > MAX_LINES:
        lines.append(f"lost: and {len(recovered.gaps) - MAX_LINES} more")
    return lines


def _gap_line(gap: UnreadableRange) -> str:
    match gap.before_ns, gap.after_ns:
        case None, None:
            when = ""
        case None, int(after_ns):
            when = f", before {_clock(after_ns)}"
        case int(before_ns), None:
            when = f", after {_clock(before_ns)}"
        case int(before_ns), int(after_ns):
            when = f", between {_clock(before_ns)} and {_clock(after_ns)}"
    return f"lost: {gap.bytes} bytes at {gap.offset}{when}: {gap.why}"


def _clock(time_ns: int) -> str:
    return f"{datetime.fromtimestamp(time_ns // 1000 / 1e6, UTC):%H:%M:%S.%f}"[:-3] + " UTC"


class _Rewriter:
    """One file being written from the items of another."""

    def __init__(self, file: BufferedWriter, recovered: Recovered) -> None:
        self._file = file
        self._recovered = recovered
        self._writer = Writer(file, enable_data_crcs=True)
        self._header: Header | None = None
        self._started = False
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._written_schemas: dict[tuple[str, str, bytes], int] = {}
        self._written_channels: dict[ChannelKey, int] = {}
        self._ids: dict[int, int] = {}  # of the channels of the file that is read
        self._last_ns: int | None = None
        self._open_gaps: list[Damage] = []

    def run(self, watch: Callable[[int], None]) -> None:
        recovered = self._recovered
        for item in items_of(recovered.path, watch):
            match item:
                case Message():
                    self._message(item)
                case ChunkEnd():
                    self._writer.flush()  # type: ignore[no-untyped-call]  # mcap's annotations lack "-> None"
                case Schema():
                    self._schemas[item.id] = item
                    self._ids.clear()
                case Channel():
                    self._channels[item.id] = item
                    self._ids.pop(item.id, None)
                case Header():
                    self._header = item
                case Metadata():
                    self._start()
                    self._writer.add_metadata(item.name, item.metadata)
                case Attachment():
                    self._start()
                    self._writer.add_attachment(item.create_time, item.log_time, item.name, item.media_type, item.data)
                    recovered.attachments += 1
                case Damage():
                    recovered.losses.add(item)
                    self._open_gaps.append(item)
        self._close_gaps(None)
        self._start()
        for id in self._channels:  # also those whose messages are lost
            self._id(id)
        if recovered.lost:
            lost = recovered.losses.description(recovered.messages)
            self._writer.add_metadata("recovered", {"from": recovered.path.name, "lost": lost})
        self._writer.finish()  # type: ignore[no-untyped-call]  # as above
        self._file.flush()
        os.fsync(self._file.fileno())

    def _start(self) -> None:
        if not self._started:
            self._started = True
            self._writer.start(*((self._header.profile, self._header.library) if self._header else ("", LIBRARY)))

    def _message(self, message: Message) -> None:
        recovered = self._recovered
        if message.channel_id not in self._channels:
            recovered.losses.orphans += 1
            return
        self._start()
        if self._open_gaps:
            self._close_gaps(message.log_time)
        self._writer.add_message(
            self._id(message.channel_id), message.log_time, message.data, message.publish_time, message.sequence
        )
        recovered.messages += 1
        recovered.bytes += len(message.data)
        self._last_ns = message.log_time
        if recovered.start_ns is None or recovered.end_ns is None:
            recovered.start_ns = recovered.end_ns = message.log_time
        recovered.start_ns = min(recovered.start_ns, message.log_time)
        recovered.end_ns = max(recovered.end_ns, message.log_time)

    def _close_gaps(self, after_ns: int | None) -> None:
        for damage in self._open_gaps:
            if len(self._recovered.gaps) < MAX_GAPS and not damage.index:
                gap = UnreadableRange(damage.offset, damage.length, damage.why, self._last_ns, after_ns)
                self._recovered.gaps.append(gap)
        self._open_gaps.clear()

    def _id(self, id: int) -> int:
        """Id in the new file; the channel and its schema are written before their first message."""
        if id in self._ids:
            return self._ids[id]
        channel = self._channels[id]
        schema = self._schemas.get(channel.schema_id)
        schema_key = (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
        key = (channel.topic, channel.message_encoding, *schema_key, tuple(channel.metadata.items()))
        if key not in self._written_channels:
            if schema and schema_key not in self._written_schemas:
                self._written_schemas[schema_key] = self._writer.register_schema(*schema_key)
            self._written_channels[key] = self._writer.register_channel(
                channel.topic, channel.message_encoding, self._written_schemas.get(schema_key, 0), channel.metadata
            )
        self._ids[id] = self._written_channels[key]
        return self._ids[id]
