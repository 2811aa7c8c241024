"""`zenocap info`: what is in a take, read once from beginning to end, remembering little."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from common import messages as m
from common.codec import BadMessage
from common.take.reading import Recorded, Take, envelope
from common.topics import ASSIGNMENT, HEALTH, POSTURE, SIGHTING, SILHOUETTE, TRACKER_POSE, topic_at
from services.takes.chunks import chunk_counts
from services.takes.tallies import (
    Channel,
    ChannelTally,
    Frames,
    FrameTally,
    HealthTally,
    Pairs,
    Recognised,
    ServiceHealth,
    Tracked,
)

BY_FRAME = (SIGHTING, SILHOUETTE)  # what a viewer says about every frame


@dataclass(frozen=True)
class Info:
    """start_ns, end_ns: of the first and last message in time, since the Unix epoch; start, end: the same, UTC, ISO 8601.

    rig: of the first key of ours, "" in a take of others.  unreadable: messages of ours that this version cannot read.
    chunks: by compression.  attachments: name to bytes.  cut: what is missing, None for a whole file.
    """

    path: str
    rig: str
    size_bytes: int
    start_ns: int
    end_ns: int
    start: str
    end: str
    duration_s: float
    messages: int
    unreadable: int
    cut: str | None
    library: str
    chunks: dict[str, int]
    channels: tuple[Channel, ...]
    frames: tuple[Frames, ...]
    pairs: Pairs | None
    tracked: Tracked | None
    recognised: Recognised | None
    health: tuple[ServiceHealth, ...]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, int]


def info(path: Path) -> Info:
    """What the take at `path` has.  Raises TakeError."""
    take, tally = Take(path), _Tally()
    for recorded in take.messages():
        tally.see(recorded)
    start_ns = min((channel.first_ns for channel in tally.channels.values()), default=0)
    end_ns = max((channel.last_ns for channel in tally.channels.values()), default=0)
    return Info(
        path=str(path),
        rig=tally.rig,
        size_bytes=path.stat().st_size,
        start_ns=start_ns,
        end_ns=end_ns,
        start=utc(start_ns),
        end=utc(end_ns),
        duration_s=(end_ns - start_ns) / 1e9,
        messages=sum(channel.messages for channel in tally.channels.values()),
        unreadable=tally.unreadable,
        cut=take.cut,
        library=take.library,
        chunks=chunk_counts(path),
        channels=tuple(
            Channel(
                key=key,
                schema=schema,
                encoding=encoding,
                messages=one.messages,
                bytes=one.bytes,
                rate=one.rate(),
                gap_s=one.gap_ns / 1e9,
                gap_at_s=(one.gap_at_ns - start_ns) / 1e9,
            )
            for (key, schema, encoding), one in sorted(tally.channels.items())
        ),
        frames=tuple(one.frames(viewer, topic) for (viewer, topic), one in sorted(tally.frames.items())),
        pairs=tally.pairs if tally.pairs.instants else None,
        tracked=tally.tracked if tally.tracked.poses else None,
        recognised=tally.recognised if tally.recognised.answers else None,
        health=tuple(one.health(service, id) for (service, id), one in sorted(tally.health.items())),
        metadata=take.metadata,
        attachments={name: len(data) for name, data in take.attachments.items()},
    )


def utc(time_ns: int) -> str:
    """ISO 8601 to the millisecond; times past the year 9999, which are damage, become that year's end."""
    seconds = min(time_ns // 10**9, 253_402_300_799)
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%dT%H:%M:%S}.{time_ns // 10**6 % 1000:03d}Z"


class _Tally:
    """Everything that is counted over the messages of one take."""

    def __init__(self) -> None:
        self.channels: dict[tuple[str, str, str], ChannelTally] = {}
        self.frames: dict[tuple[str, str], FrameTally] = {}
        self.health: dict[tuple[str, str], HealthTally] = {}
        self.pairs = Pairs()
        self.tracked = Tracked()
        self.recognised = Recognised()
        self.unreadable = 0
        self.rig = ""

    def see(self, recorded: Recorded) -> None:
        channel = (recorded.topic, recorded.schema, recorded.encoding)
        self.channels.setdefault(channel, ChannelTally()).see(recorded.log_ns, len(recorded.data))
        topic = topic_at(recorded.topic) if recorded.encoding == "msgpack" else None
        names = topic.names(recorded.topic) if topic else None
        if topic is None or names is None:
            return
        self.rig = self.rig or names["rig"]
        if topic in BY_FRAME:  # their number stands beside them, so that masks need not be unpacked
            self.frames.setdefault((names["viewer"], topic.name), FrameTally()).see(recorded.sequence)
        elif topic in (ASSIGNMENT, TRACKER_POSE, POSTURE, HEALTH):
            self._read(recorded)

    def _read(self, recorded: Recorded) -> None:
        try:
            received = envelope(recorded)
        except BadMessage:
            self.unreadable += 1
            return
        match received.message if received else None:
            case m.Assignment() as assignment:
                self.pairs.see(assignment)
            case m.TrackerPose() as pose:
                self.tracked.see(pose)
            case m.Posture() as posture:
                self.recognised.see(posture)
            case m.Health() as health:
                self.health.setdefault((health.service, health.id), HealthTally()).see(health)
