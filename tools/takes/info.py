"""`zenocap info`: content of a take, read once from beginning to end, in bounded memory."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from zenocap.common import messages as m
from zenocap.common import topics
from zenocap.common.camera_advice import TakeAdvice, TakeFault
from zenocap.common.codec import BadMessage
from zenocap.common.formats.pose_track import Bound
from zenocap.common.observe.account import METADATA, Account, read_account
from zenocap.common.recording.reader import Recorded, TakeReader, envelope
from zenocap.common.recording.setup_file import PARAMETERS_FILE, read_parameters
from zenocap.common.recording.take_account import refused_of, services_in
from zenocap.common.topics import topic_at
from zenocap.tools.judge.evidence import TakeEvidence
from zenocap.tools.judge.verdict import USED, verdict_of
from zenocap.tools.takes.take_health import HealthTally, RateTally, ReducedRate, ServiceHealth
from zenocap.tools.takes.take_part import TakePart
from zenocap.tools.takes.take_statistics import (
    ChannelStatistics,
    ChannelTally,
    Commands,
    CommandTally,
    Frames,
    FrameTally,
    Pairs,
    PoseStatistics,
    Recognized,
)

BY_FRAME = (topics.SIGHTING, topics.SILHOUETTE)  # published by a viewer for every frame
UPDATE_EVERY = 1000  # messages between two calls of `watch`

READ = (
    *USED, topics.ASSIGNMENT, topics.POSTURE, topics.COMMAND, topics.HEALTH, topics.VERDICT, topics.FRAME_RATE,
    topics.TRACKER_DETAIL, topics.CAMERA_DELAYS,
)  # fmt: skip


@dataclass(frozen=True)
class AccountLine:
    """Messages of one topic of one service: sent == recorded + refused + missing + unlogged.

    refused: received by the log, and not written.  missing: not received although it was on.  unlogged: sent before it was.
    unknown: log times (ns) without a count: after the last report of a process that was killed, or went on.
    """

    service: str
    id: str
    topic: str
    sent: int
    recorded: int
    refused: int
    missing: int
    unlogged: int
    unknown: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Info:
    """Content of a take.

    start_ns, end_ns: log time of the first and last message since the Unix epoch; start, end: the same in ISO 8601.

    rig: of the first zenocap key, "" without one.  unreadable: messages that this version cannot decode.
    chunks: that were read, by compression.  attachments: name to bytes.  parameters: service to number of values.
    cut: missing content, None for a complete file.  height_ratio: height of the person in the side view over that in the
    front view, of the last measured body.
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
    channels: tuple[ChannelStatistics, ...]
    frames: tuple[Frames, ...]
    pairs: Pairs | None
    height_ratio: float | None
    reduced: ReducedRate | None  # None when all frames were processed
    delays: m.CameraDelays | None  # the last ones found of the cameras
    tracked: PoseStatistics | None
    recognised: Recognized | None  # spelled as in the JSON of `zenocap info`
    commands: Commands | None
    health: tuple[ServiceHealth, ...]
    account: tuple[AccountLine, ...]  # of services that report what they send
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, int]
    parameters: dict[str, int]
    verdict: m.Verdict | None  # stored, or else of the messages read; None without poses or silhouettes
    verdict_stored: bool
    advice: tuple[TakeFault, ...]  # of the cameras' images, the worst first


def info(
    path: Path, first: Bound | None = None, last: Bound | None = None, watch: Callable[[int], None] = lambda _: None,
) -> Info:  # fmt: skip
    """Content of the take at `path`, of the part from `first` to `last`.  Raises UserError.

    watch: is called with the number of messages read.
    """
    take, tally, part = TakeReader(path), _Tally(), TakePart(first, last)
    for count, recorded in enumerate(take.messages()):
        if not count:
            tally.account.own = services_in(take)
        if part.includes(recorded):
            tally.add(recorded)
        if count % UPDATE_EVERY == 0:
            watch(count)
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
        chunks=dict(sorted(take.chunks.items())),
        channels=tuple(one.statistics(*channel, start_ns) for channel, one in sorted(tally.channels.items())),
        frames=tuple(one.frames(viewer, topic) for (viewer, topic), one in sorted(tally.frames.items())),
        pairs=tally.pairs if tally.pairs.instants else None,
        height_ratio=tally.height_ratio,
        reduced=tally.rate.reduced(end_ns),
        delays=tally.delays,
        tracked=tally.tracked if tally.tracked.poses else None,
        recognised=tally.recognized if tally.recognized.answers else None,
        commands=tally.commands.commands(),
        health=tuple(one.health(service, id) for (service, id), one in sorted(tally.health.items())),
        account=tuple(_account(tally, {} if first or last else take.metadata.get(METADATA, {}))),
        metadata={name: values for name, values in take.metadata.items() if name != METADATA},
        attachments={name: len(data) for name, data in take.attachments.items()},
        parameters=_parameters(path, take),
        verdict=tally.verdict_of(),
        verdict_stored=tally.verdict is not None,
        advice=tuple(tally.advice.faults()),
    )


def _account(tally: "_Tally", stored: Mapping[str, str]) -> Iterator[AccountLine]:
    """Lines of the stored account of a take, or of the messages that were read."""
    account = read_account(stored) or tally.account
    refused = refused_of(account, {key: one.messages for (key, *_), one in tally.channels.items()})
    for ((service, id), topic), line in account.lines().items():
        more = refused[(service, id), topic]
        recorded = line.seen - more
        yield AccountLine(service, id, topic, line.sent, recorded, more, line.missing, line.unlogged, line.unknown)


def _parameters(path: Path, take: TakeReader) -> dict[str, int]:
    data = take.attachments.get(PARAMETERS_FILE)
    return {} if data is None else {name: len(values) for name, values in read_parameters(path, data).items()}


def utc(time_ns: int) -> str:
    """ISO 8601 to the millisecond; times beyond the year 9999 come from damage and become its end."""
    seconds = min(time_ns // 10**9, 253_402_300_799)
    return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%dT%H:%M:%S}.{time_ns // 10**6 % 1000:03d}Z"


class _Tally:
    """Counts over the messages of one take."""

    def __init__(self) -> None:
        self.channels: dict[tuple[str, str, str], ChannelTally] = {}
        self.frames: dict[tuple[str, str], FrameTally] = {}
        self.health: dict[tuple[str, str], HealthTally] = {}
        self.account = Account()
        self.pairs = Pairs()
        self.height_ratio: float | None = None
        self.tracked = PoseStatistics()
        self.recognized = Recognized()
        self.commands = CommandTally()
        self.rate = RateTally()
        self.unreadable = 0
        self.rig = ""
        self.evidence = TakeEvidence()
        self.verdict: m.Verdict | None = None
        self.advice = TakeAdvice()
        self.delays: m.CameraDelays | None = None

    def add(self, recorded: Recorded) -> None:
        channel = (recorded.topic, recorded.schema, recorded.encoding)
        self.channels.setdefault(channel, ChannelTally()).add(recorded.log_ns, len(recorded.data))
        topic = topic_at(recorded.topic) if recorded.encoding == "msgpack" else None
        names = topic.names(recorded.topic) if topic else None
        if topic is None or names is None:
            return
        self.rig = self.rig or names["rig"]
        if topic in BY_FRAME:  # the sequence number is the frame number: masks need no unpacking
            self.frames.setdefault((names["viewer"], topic.name), FrameTally()).add(recorded.sequence)
        message = self._read(recorded) if topic in READ else None
        self.account.add_message(recorded.topic, recorded.log_ns, message if isinstance(message, m.Health) else None)

    def _read(self, recorded: Recorded) -> m.Message | None:
        try:
            received = envelope(recorded)
        except BadMessage:
            self.unreadable += 1
            return None
        if received is None:
            return None
        self.evidence.add(received.message)
        self._keep(received.message)
        return received.message

    def _keep(self, message: m.Message) -> None:
        """Keep what only the last message of a kind says, and count the others."""
        match message:
            case m.Verdict() as verdict:
                self.verdict = verdict
            case m.CameraDelays() as delays:
                self.delays = delays if delays.found_ms else self.delays
            case m.UniversalBdp() as body:
                self.height_ratio = body.ratio
            case m.TrackerBdp(measured=measured):
                self.tracked.measured = measured
            case m.CameraAdvice() as advice:
                self.advice.add(advice)
            case m.Assignment() as assignment:
                self.pairs.add(assignment)
            case m.TrackerPose() as pose:
                self.tracked.add(pose)
            case m.Posture() as posture:
                self.recognized.add(posture)
            case m.CommandResult() as result:
                self.commands.add(result)
            case m.FrameRate() | m.TrackerDetail() as decision:
                self.rate.add(decision)
            case m.Health() as health:
                self.health.setdefault((health.service, health.id), HealthTally()).add(health)
            case _:
                pass

    def verdict_of(self) -> m.Verdict | None:
        """The recorded verdict, or that on what was read; None without a pose or a silhouette."""
        if self.verdict is None and (self.evidence.forward or self.evidence.samples):
            return verdict_of(self.evidence)
        return self.verdict
