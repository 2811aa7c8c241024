"""A realistic mixture of messages: all messages of the tracked demo, stored between runs."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec

from benchmarks.people.films import SMALL, Size
from tests.support.stored import stored_files
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import encode
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.rig.rig import demo_rig
from zenocap.tools.takes.rig_changes import at_working_size
from zenocap.tools.takes.track import track

START_NS = 1_700_000_000_000_000_000


def tracked_take(folder: Path, size: Size = SMALL) -> Path:
    """Take of the demo rig at a working size in a folder, tracked once."""

    def made(place: Path) -> None:
        track(at_working_size(demo_rig("two-view"), size, None), place / "demo.mcap")

    return stored_files(folder, made, size, sources=(__name__, "zenocap.services")) / "demo.mcap"


def mixture(size: Size = SMALL) -> list[Envelope]:
    """All messages of the tracked demo, in the order of publication."""
    with TemporaryDirectory() as folder:
        found = [envelope(recorded) for recorded in TakeReader(tracked_take(Path(folder), size)).messages()]
    return [each for each in found if each is not None]


def instants(messages: list[Envelope]) -> list[list[Envelope]]:
    """The messages grouped by frame set; only frame sets with a partial BAP of both viewers."""
    groups: list[list[Envelope]] = [[]]
    for each in messages:
        if groups[-1] and each.received_ns != groups[-1][-1].received_ns:
            groups.append([])
        groups[-1].append(each)
    whole = [group for group in groups if sum(isinstance(each.message, m.PartialBap) for each in group) == 2]
    assert len(whole) > 100, "too few instants are tracked"
    return whole


def with_viewers(instant: list[Envelope], count: int, frame: int, now_ns: int) -> Iterator[Envelope]:
    """The messages of a frame set as published by `count` viewers, with a new time and frame number."""
    for each in instant:
        viewer = getattr(each.message, "viewer", None)
        ids = [viewer] if viewer is None else [str(k + 1) for k in range(count) if str(k % 2 + 1) == viewer]
        for id in ids:
            new = {"frame": frame, "captured_ns": now_ns} | ({} if id is None else {"viewer": id})
            message = msgspec.structs.replace(each.message, **new)
            key = each.topic.at("demo", **each.topic.names_of(message))
            yield replace(each, key=key, message=message, received_ns=now_ns, data=encode(message))
