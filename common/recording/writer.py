"""MCAP writer of takes: crash-safe and deterministic, equal messages give equal bytes.

Each key is a channel of MessagePack with a JSON Schema.  log_time is the receive time, publish_time the capture time,
sequence the message's own `frame`.  Chunks are written to disk for every second of the messages' receive times, so
that they do not depend on the time of writing.
"""

import logging
import os
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from io import BufferedWriter
from pathlib import Path
from typing import Literal, TypeAlias

import zstandard
from mcap.writer import Writer

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.messages import SCHEMA_VERSION
from zenocap.common.recording.channel_limits import ChannelLimits
from zenocap.common.rig.services import ServiceKey

logger = logging.getLogger(__name__)

LIBRARY = "zenocap"
ENCODING = "msgpack"
LOG, OPENED = "log", "opened_ns"  # metadata of the log of a rig: when it opened the file, on the machine's monotonic clock
FAILURES = (OSError, zstandard.ZstdError, MemoryError)  # of a write
FLUSH_NS = 1_000_000_000  # of receive times between writes to disk; chosen by hand


Closing: TypeAlias = Callable[[], Mapping[str, Mapping[str, str]]]  # metadata by name


class RecordingError(UserError):
    """The file cannot be created or written."""


class TakeExists(RecordingError):
    """A file of that name exists."""


@dataclass(frozen=True)
class Channel:
    """topic: a key.  encoding, schema: of its messages; the schema is in `schema_encoding`, empty without one."""

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


@dataclass(frozen=True)
class Attachment:
    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True)
class Statistics:
    """messages, bytes: written, without converted messages.  lost: not written, or possibly not on disk after an early end.

    failure: reason of an early end, else None.
    unconverted: messages whose conversion failed; the messages themselves are in the take.
    removed: files that were deleted or moved while they were written; the messages of deleted ones are lost.
    missing: lost messages that services sent and that never arrived, see `Account`.
    """

    messages: int
    bytes: int
    lost: int
    failure: str | None
    unconverted: int = 0
    removed: int = 0
    missing: int = 0

    @property
    def incomplete(self) -> bool:
        """Whether messages are missing, or not in the files that were requested."""
        return bool(self.lost or self.failure or self.removed)


def no_conversion(_: Envelope) -> tuple[tuple[Channel, bytes], ...]:
    return ()


class Recording:
    """One MCAP file being written.  Only the constructor raises: a full disk ends the recording, never its caller."""

    def __init__(
        self, path: Path, *, rig: str, start_ns: int, metadata: Mapping[str, Mapping[str, str]] | None = None,
        attachments: tuple[Attachment, ...] = (), overwrite: bool = False, own: Collection[ServiceKey] = (),
        convert: Callable[[Envelope], Iterable[tuple[Channel, bytes]]] = no_conversion, closing: Closing = dict,
    ) -> None:  # fmt: skip
        """start_ns: time of the attachments.  metadata: by name, in addition to "zenocap".  Raises RecordingError.

        own: services of the rig, whose keys are always written; of others, see `ChannelLimits`.
        convert: messages of other channels to write after a message, with its times; its errors are counted.
        closing: returns metadata to write at the end.
        """
        self.path = path
        self.closing = closing
        self._convert = convert
        self._unconverted = 0
        self._limits = ChannelLimits(path, rig, own)
        self._failure: str | None = None
        self._messages = self._bytes = self._lost = 0
        self._safe = (0, 0)  # messages and bytes already on disk
        self._flushed_ns: int | None = None
        self._channels: dict[Channel, int] = {}
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        try:
            if not path.parent.is_dir():
                path.parent.mkdir(parents=True)
            self._file: BufferedWriter = path.open("wb" if overwrite else "xb")
        except FileExistsError as error:
            if not path.exists():
                raise RecordingError(f"{path} cannot be written: {error.filename} is no folder") from error
            raise TakeExists(f"{path} exists already; choose another name or remove it") from None
        except OSError as error:
            raise RecordingError(f"{path} cannot be written: {error.strerror or error}") from error
        self._writer = Writer(self._file, enable_data_crcs=True)  # checksum also over records without their own
        try:
            self._writer.start(library=LIBRARY)
            own_metadata = {"zenocap": {"rig": rig, "schema_version": str(SCHEMA_VERSION)}}
            for name, values in (own_metadata | dict(metadata or {})).items():
                self._writer.add_metadata(name, dict(sorted(values.items())))
            for file in attachments:
                self._writer.add_attachment(start_ns, start_ns, file.name, file.media_type, file.data)
            self._sync()
            _keep_name(path.parent)
            self._comparable = _same_file(self._file.fileno(), path)
        except OSError as error:
            self._fail(error)
            raise RecordingError(self._failure) from error

    @property
    def statistics(self) -> Statistics:
        return Statistics(self._messages, self._bytes, self._lost, self._failure, self._unconverted)

    @property
    def failure(self) -> str | None:
        return self._failure

    @property
    def size_bytes(self) -> int:
        """Size of the file, without the last second that is not written yet."""
        return 0 if self._file.closed else self._file.tell()

    def removal(self) -> Literal["deleted", "moved"] | None:
        """Fate of the file when no file of its name is it any more; None while there is."""
        if self._failure or self._file.closed:
            return None
        descriptor = self._file.fileno()
        try:
            if _same_file(descriptor, self.path) or (self.path.exists() and not self._comparable):
                return None
            return "moved" if os.fstat(descriptor).st_nlink else "deleted"
        except OSError:  # a folder that may not be read any more, or a failing disk, which a write reports
            return None

    def record(self, envelope: Envelope, *, converted: bool = True) -> bool:
        """Write a message as received, and its converted messages unless `converted` is False; whether it is written."""
        kind = envelope.topic.message
        data = envelope.data or codec.encode(envelope.message)
        channel = Channel(envelope.key, ENCODING, f"zenocap.{kind.__name__}", "jsonschema", codec.json_schema(kind))
        log_ns, publish_ns, sequence = envelope.received_ns, envelope.message.captured_ns, envelope.message.frame
        if not self.write(channel, data, log_ns, publish_ns, sequence):
            return False
        if not converted:
            return True
        try:
            others = list(self._convert(envelope))
        except Exception as error:  # errors of display channels must not end the log
            self._unconverted += 1
            if self._unconverted == 1:
                text = "%s: no conversion of %s frame %d (further ones are counted only): %s: %s"
                logger.warning(text, self.path, envelope.key, sequence, type(error).__name__, error)
            return True
        for other, copy in others:
            self._put(other, copy, log_ns, publish_ns, sequence, limited=False)
        return True

    def write(self, channel: Channel, data: bytes, log_ns: int, publish_ns: int, sequence: int = 0) -> bool:
        """Write bytes to any channel, such as those of other schemas; whether they are written."""
        written = self._put(channel, data, log_ns, publish_ns, sequence)
        self._messages += written
        self._bytes += written * len(data)
        self._lost += not written
        return written

    def _put(
        self, channel: Channel, data: bytes, log_ns: int, publish_ns: int, sequence: int, *, limited: bool = True
    ) -> bool:
        if self._failure or (limited and not self._limits.admits(channel.topic)):
            return False
        try:
            if self._flushed_ns is None:
                self._flushed_ns = log_ns
            if not 0 <= log_ns - self._flushed_ns < FLUSH_NS:  # also when the clock was set back
                self._sync()
                self._flushed_ns = log_ns
            self._writer.add_message(self._channel_id(channel), log_ns, data, publish_ns, sequence % 2**32)
        except FAILURES as error:
            self._fail(error)
            return False
        return True

    def flush(self) -> None:
        """Write everything to disk now, for a live log without further messages."""
        if not self._failure:
            try:
                self._sync()
            except FAILURES as error:
                self._fail(error)

    def close(self) -> Statistics:
        """Finish the file with its index.  Repeated calls have no effect."""
        if not self._failure and not self._file.closed:
            try:
                for name, values in self.closing().items():
                    self._writer.add_metadata(name, dict(sorted(values.items())))
                self._writer.finish()  # type: ignore[no-untyped-call]  # mcap's annotations lack "-> None"
                self._file.flush()
                os.fsync(self._file.fileno())
                self._file.close()
                self._safe = (self._messages, self._bytes)
            except FAILURES as error:
                self._fail(error)
        return self.statistics

    def _channel_id(self, channel: Channel) -> int:
        if channel in self._channels:
            return self._channels[channel]
        schema = (channel.schema_name, channel.schema_encoding, channel.schema)
        if channel.schema and schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(*schema)
        schema_id = self._schemas.get(schema, 0)
        self._channels[channel] = self._writer.register_channel(channel.topic, channel.encoding, schema_id)
        return self._channels[channel]

    def _sync(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]  # mcap's annotations lack "-> None"
        os.fsync(self._file.fileno())
        self._safe = (self._messages, self._bytes)

    def _fail(self, error: Exception) -> None:
        self._lost += self._messages - self._safe[0]
        self._messages, self._bytes = self._safe
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
        self._failure = f"{self.path}: recording stopped after {self._messages} messages: {reason}"
        logger.error("%s", self._failure)
        try:
            self._file.close()  # flushes again and may fail again
        except OSError:
            self._file.raw.close()


def _same_file(descriptor: int, path: Path) -> bool:
    """Whether `path` is the open file.  Raises OSError when that is unknown."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except (FileNotFoundError, NotADirectoryError):
        return False


def _keep_name(folder: Path) -> None:
    """Sync the folder to disk where the system supports it, so that a new file keeps its name after a crash."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)
