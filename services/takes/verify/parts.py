"""The parts of a take as verification needs them: in order, our messages, nothing twice, and the setup."""

from collections.abc import Iterator
from pathlib import Path

from common import codec
from common.bus.protocol import Envelope
from common.messages import Handled
from common.take.reading import Take, TakeError, envelope
from common.take.setup import SETUP_FILE, RecordedRig, read_setup


def begins_ns(path: Path) -> int:
    """Time of the first account in a file."""
    for received in ours(Take(path)):
        if isinstance(received.message, Handled):
            return received.received_ns
    return 0


def ours(take: Take) -> Iterator[Envelope]:
    """Our messages; those that a part repeats from the ones before are left out."""
    number = 0
    for recorded in take.messages():
        try:
            received = envelope(recorded)
        except codec.BadMessage:
            continue  # cannot have been fed to anybody
        if received is None:
            continue
        number += 1
        part = take.metadata.get("part", {})
        if part.get("number", "1") != "1" and number <= int(part.get("repeated", "0")):
            continue
        yield received


def setup_in(path: Path, take: Take) -> RecordedRig:
    if SETUP_FILE not in take.attachments:
        raise TakeError(
            f"{path}: no attachment {SETUP_FILE}: it was made by an older version, or by `zenocap record` without the rig "
            "file; what the services were set up with is not known"
        )
    return read_setup(path, take.attachments[SETUP_FILE])
