"""Reader of takes, also of truncated and damaged ones."""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Literal

from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.recording.mcap_content import COMPRESSED, LARGE
from zenocap.common.recording.mcap_records import ChunkEnd, Damage, Item, NotMcap, Records
from zenocap.common.topics import TOPICS, Topic, topic_at

MAX_KEPT = 256 << 20  # bytes of metadata, attachments, schemas and channels held at once; chosen by hand
MAX_DAMAGES = 1000  # described individually; chosen by hand
# A message that is so much earlier than that before it, of another channel, is in another order; chosen by hand.
APART_NS, MOST_APART = 1_000_000_000, 2  # MOST_APART: channels may begin while a clock is set back


@dataclass(frozen=True)
class Recorded:
    """One message of a take, not decoded.  topic: its key.  schema: name of its schema, "" without one."""

    topic: str
    encoding: str
    schema: str
    data: bytes
    log_ns: int
    publish_ns: int
    sequence: int


@dataclass
class UnreadableParts:
    """Unreadable content of a file.  bytes: of the file.  orphans: messages whose channel is lost.  spans_ns: log times.

    index: there is damage after the data, where no message is.  first: descriptions, at most MAX_DAMAGES.
    unordered: messages are in another order than that of time, more of them than restarts of a service explain.
    """

    bytes: int = 0
    chunks: int = 0
    stretches: int = 0
    orphans: int = 0
    index: bool = False
    cut: bool = False
    unordered: bool = False
    spans_ns: list[tuple[int, int]] = field(default_factory=list)
    first: list[Damage] = field(default_factory=list)

    def add(self, damage: Damage) -> None:
        if len(self.first) < MAX_DAMAGES:
            self.first.append(damage)
            if damage.span_ns:
                self.spans_ns.append(damage.span_ns)
        self.cut = self.cut or damage.cut
        if damage.index:
            self.index = True
            return
        self.bytes += damage.length
        self.chunks += damage.chunk
        self.stretches += not damage.chunk and not damage.cut

    def __bool__(self) -> bool:
        return bool(self.first or self.orphans or self.unordered)

    @property
    def data(self) -> bool:
        """Whether more than the index is lost."""
        return bool(self.orphans or any(not damage.index for damage in self.first))

    def description(self, count: int) -> str:
        """Description for display, with the number of messages that were read."""
        read = f"{count} messages read"
        if self.unordered and not (self.first or self.orphans):
            return f"its messages are in another order than that of time, in which `mcap sort` writes them; {read}"
        reasons = [damage.why for damage in self.first if damage.chunk]
        if reasons and all(why.startswith((COMPRESSED, LARGE)) for why in reasons):
            return f"{self.chunks} chunks lost: {reasons[0]}; {read}"
        if self.stretches and not (self.bytes or self.chunks or self.orphans):
            return f"damaged: {next(damage.why for damage in self.first if not damage.index)}; {read}"
        if self.chunks or self.orphans or self.stretches:
            counts = {"chunks": self.chunks, "other places": self.stretches, "messages of unknown channels": self.orphans}
            parts = [f"{number} {kind}" for kind, number in counts.items() if number]
            return f"damaged: {', '.join(parts)} lost, {self.bytes} bytes{', and cut' if self.cut else ''}; {read}"
        if self.data:
            return f"cut before its end, {read}"
        return f"{'cut before its end, within' if self.cut else 'damaged, in'} its index: all {read}"


@dataclass
class TakeReader:
    """The messages of a file in the order of writing.  The other fields are complete after the end of `messages`.

    cut: description of the damage, None for an intact file.  chunks: number of those that were read, by compression.
    """

    path: Path
    cut: str | None = None
    library: str = ""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    losses: UnreadableParts = field(default_factory=UnreadableParts)
    chunks: Counter[str] = field(default_factory=Counter)

    def messages(self) -> Iterator[Recorded]:
        """Iterate over the messages.  Raises UserError when the file is unreadable or no MCAP file; damage sets `cut`."""
        self.cut, self.losses, self.chunks = None, UnreadableParts(), Counter()
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        last: dict[int, tuple[int, int]] = {}
        count = back = apart = before_ns = 0
        for item in items_of(self.path):
            match item:
                case Message():
                    channel = channels.get(item.channel_id)
                    if channel is None:
                        self.losses.orphans += 1
                        continue
                    count += 1
                    own_ns, own = last.get(item.channel_id, (0, 0))
                    # Where a clock was set back, the log times of every channel fall, and its numbers do not.
                    back += item.log_time < own_ns and item.sequence < own
                    apart += own_ns <= item.log_time < before_ns - APART_NS
                    last[item.channel_id], before_ns = (item.log_time, item.sequence), item.log_time
                    yield recorded_of(item, channel, schemas)
                case Schema():
                    schemas[item.id] = item
                case Channel():
                    channels[item.id] = item
                case Header():
                    self.library = item.library
                case Metadata():
                    self.metadata[item.name] = item.metadata
                case Attachment():
                    self.attachments[item.name] = item.data
                case Damage():
                    self.losses.add(item)
                case ChunkEnd():
                    self.chunks[item.compression] += 1
        self.losses.unordered = back > len(channels) or apart > MOST_APART
        if self.losses:
            self.cut = f"{self.path}: {self.losses.description(count)}"

    def envelopes(
        self, topics: Collection[Topic] = TOPICS, *, invalid: Literal["skip", "raise"] = "skip"
    ) -> Iterator[Envelope]:
        """Decoded messages of some topics; the others are not decoded.  Raises as `messages`.

        invalid: what becomes of a message that this version cannot decode; "raise": raises BadMessage.
        """
        for recorded in self.messages():
            if topic_at(recorded.topic) not in topics:
                continue
            try:
                received = envelope(recorded)
            except codec.BadMessage:
                if invalid == "raise":
                    raise
                continue
            if received is not None:
                yield received


def items_of(path: Path, watch: Callable[[int], None] = lambda _: None) -> Iterator[Item]:
    """The items of a file in order.  Raises UserError when it cannot be read or is no MCAP file.

    watch: called after each chunk with the number of bytes read.
    Attachments, metadata, schemas and channels beyond MAX_KEPT bytes become damage, because readers hold all of them.
    """
    try:
        with path.open("rb") as file:
            yield from _bounded(file, watch)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror or error}") from error
    except NotMcap:
        raise UserError(f"{path} is no MCAP file") from None


def _bounded(file: BinaryIO, watch: Callable[[int], None]) -> Iterator[Item]:
    kept = 0
    for item in Records(file):
        match item:
            case Attachment() | Schema():
                kept += 1000 + len(item.data)
            case Metadata() | Channel():
                kept += 1000 + sum(len(name) + len(value) for name, value in item.metadata.items())
            case _:
                yield item
                if isinstance(item, ChunkEnd | Damage):
                    watch(file.tell())
                continue
        if kept > MAX_KEPT:
            yield Damage(file.tell(), 0, f"more than {MAX_KEPT} bytes of attachments and descriptions")
        else:
            yield item


def envelope(recorded: Recorded) -> Envelope | None:
    """Decoded message as received; None for channels of other programs.  Raises BadMessage."""
    topic = topic_at(recorded.topic)
    if topic is None or recorded.encoding != "msgpack":
        return None
    message = codec.decode(recorded.data, topic.message)
    return Envelope(recorded.topic, topic, message, recorded.log_ns, recorded.data)


def recorded_of(message: Message, channel: Channel, schemas: Mapping[int, Schema]) -> Recorded:
    """A message of the file with the names of its channel and schema."""
    schema = schemas.get(channel.schema_id)
    return Recorded(
        topic=channel.topic, encoding=channel.message_encoding, schema=schema.name if schema else "", data=message.data,
        log_ns=message.log_time, publish_ns=message.publish_time, sequence=message.sequence,
    )  # fmt: skip
