"""The real mixture of messages: what the demo's rig says when it is tracked, kept between runs."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec

from common import messages as m
from common.bus.protocol import Envelope
from common.codec import encode
from common.runtime.rig import demo_rig
from common.take.reading import Take, envelope
from services.takes.track import at_working_size, track
from tests.evaluation.takes import SMALL, Size, default_folder

START_NS = 1_700_000_000_000_000_000


def tracked_take(size: Size = SMALL) -> Path:
    """The take of the demo's rig at a working size, tracked once."""
    path = default_folder() / f"demo-{size[0]}x{size[1]}.mcap"
    if not path.is_file():
        part = path.with_suffix(f".{os.getpid()}.mcap")  # renamed when whole: another process may look for it
        track(at_working_size(demo_rig(), size, None), part)
        part.replace(path)
    return path


def mixture(size: Size = SMALL) -> list[Envelope]:
    """Every message of it, in the order it was said."""
    found = [envelope(recorded) for recorded in Take(tracked_take(size)).messages()]
    return [each for each in found if each is not None]


def instants(said: list[Envelope]) -> list[list[Envelope]]:
    """Grouped by instant of the time when a pose is tracked: each has every viewer's messages and the integrator's."""
    groups: list[list[Envelope]] = [[]]
    for each in said:
        if groups[-1] and each.received_ns != groups[-1][-1].received_ns:
            groups.append([])
        groups[-1].append(each)
    whole = [group for group in groups if sum(isinstance(each.message, m.PartialBap) for each in group) == 2]
    assert len(whole) > 100, "too few instants are tracked"
    return whole


def with_viewers(instant: list[Envelope], count: int, frame: int, now_ns: int) -> Iterator[Envelope]:
    """The same said by `count` viewers, at another time and frame, with its bytes."""
    for each in instant:
        viewer = getattr(each.message, "viewer", None)
        ids = [viewer] if viewer is None else [str(k + 1) for k in range(count) if str(k % 2 + 1) == viewer]
        for id in ids:
            new = {"frame": frame, "captured_ns": now_ns} | ({} if id is None else {"viewer": id})
            message = msgspec.structs.replace(each.message, **new)
            key = each.topic.at("demo", **each.topic.names_of(message))
            yield replace(each, key=key, message=message, received_ns=now_ns, data=encode(message))


def sized(said: list[Envelope]) -> tuple[int, int]:
    """Messages and bytes."""
    return len(said), sum(len(each.data) for each in said)
