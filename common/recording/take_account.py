"""Account of a take: messages sent by the rig, received by the log, and stored."""

from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment

from zenocap.common import codec
from zenocap.common.errors import UserError
from zenocap.common.messages import Health
from zenocap.common.observe.account import METADATA, Account, read_account, sender_of
from zenocap.common.recording.reader import TakeReader, items_of
from zenocap.common.recording.setup_file import SETUP_FILE, read_setup
from zenocap.common.recording.summary import metadata_of, read_summary
from zenocap.common.recording.writer import LOG, OPENED
from zenocap.common.rig.services import ServiceKey, services_of
from zenocap.common.topics import HEALTH, topic_at

COMMANDS = {"recorder": "record", "recovered": "recover"}  # by their metadata
Place = tuple[ServiceKey, str]  # service, and name of the topic


@dataclass(frozen=True)
class TakeAccount:
    """rig: name; "" of a file that was cut before it.  messages: in the file.

    start_ns: log time of its first message; where there is none of the files at its beginning, else of its last change.
    refused: messages that the log received and that are not in the file.  take, previous: of a part, names of the first and
    of the earlier file; "" otherwise.  complete: whether the file was finished by its log.
    command: that has written it; "" for the log of a rig.  opened_ns: when that opened it, on the monotonic clock of the
    machine; 0 if that is unknown.
    """

    path: Path
    rig: str
    start_ns: int
    messages: int
    account: Account
    refused: Counter[Place]
    take: str = ""
    previous: str = ""
    complete: bool = True
    command: str = ""
    opened_ns: int = 0


def take_account(path: Path, on_reading: Callable[[Path], None] = lambda _: None) -> TakeAccount:
    """The account in a take; of a cut or damaged one, and of one without, it is that of the messages that can be read.

    on_reading: called before all messages are read.

    Raises UserError when it is no take or cannot be read.
    """
    try:
        summary = read_summary(path)
        metadata = {} if summary is None else metadata_of(path, summary)
    except OSError:
        summary, metadata = None, {}
    account = read_account(metadata[METADATA]) if METADATA in metadata else None
    if summary is None or account is None:
        on_reading(path)
        return _scanned(path, complete=summary is not None)
    written = {summary.channels[id].topic: count for id, count in summary.counts.items() if id in summary.channels}
    return _taken(path, metadata, summary.start_ns, summary.messages, account, refused_of(account, written))


def services_in(take: TakeReader) -> frozenset[ServiceKey]:
    """Services of the rig of a take of which a message has been read; none where it does not say."""
    with suppress(UserError, KeyError):
        return frozenset(services_of(read_setup(take.path, take.attachments[SETUP_FILE])))
    return frozenset()


def _scanned(path: Path, *, complete: bool) -> TakeAccount:
    """The account of the messages of a take; only healths are decoded."""
    take, account, first, count = TakeReader(path), Account(), 0, 0
    for recorded in take.messages():
        if not count:
            account.own = services_in(take)
        first, count = first or recorded.log_ns, count + 1
        if recorded.encoding != "msgpack":
            continue
        health: Health | None = None
        if topic_at(recorded.topic) is HEALTH:
            with suppress(codec.BadMessage):
                health = codec.decode(recorded.data, Health)
        account.add_message(recorded.topic, recorded.log_ns, health)
    return _taken(path, take.metadata, first, count, account, Counter(), complete=complete)


def _taken(
    path: Path, metadata: Mapping[str, Mapping[str, str]], start_ns: int, messages: int, account: Account,
    refused: Counter[Place], *, complete: bool = True,
) -> TakeAccount:  # fmt: skip
    part, opened = metadata.get("part", {}), metadata.get(LOG, {}).get(OPENED, "")
    return TakeAccount(
        path, metadata.get("zenocap", {}).get("rig", ""), start_ns or _opened_ns(path), messages, account, refused,
        part.get("take", ""), part.get("previous", ""), complete,
        next((command for name, command in COMMANDS.items() if name in metadata), ""),
        int(opened) if opened.isdecimal() and len(opened) < 20 else 0,
    )  # fmt: skip


def _opened_ns(path: Path) -> int:
    """Log time of the first file in a take; of one without, the time of its last change."""
    with suppress(OSError, UserError):  # it was removed meanwhile
        opened = (item.log_time for item in items_of(path) if isinstance(item, Attachment))
        return next(opened, 0) or path.stat().st_mtime_ns
    return 0


def refused_of(account: Account, written: Mapping[str, int]) -> Counter[Place]:
    """Messages that a log received and did not write.  written: messages in the file, by key."""
    found: Counter[Place] = Counter()
    for key, count in written.items():
        topic = topic_at(key)
        service = sender_of(topic, key) if topic is not None else None
        if topic is not None and service is not None:
            found[service, topic.name] += count
    return +Counter({
        (service, topic): seen - found[service, topic]
        for service, sender in account.senders.items() for topic, seen in sender.seen.items()
    })  # fmt: skip


def readable(path: Path, on_reading: Callable[[Path], None]) -> TakeAccount | str:
    """The account in a take, or why it cannot be read.  on_reading: see `take_account`."""
    try:
        return take_account(path, on_reading)
    except UserError as error:
        return str(error)
