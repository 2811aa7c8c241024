"""`zenocap track`: the services of a rig over every frame of its files, in one process, without network.

Time is the frames' own, so that two runs give equal bytes.
"""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Envelope
from common.messages import Message, TrackerPose, UniversalBap
from common.runtime.clock import ManualClock
from common.runtime.rig import Rig, RigError, Viewer
from common.runtime.rig_file import TRACKER_METHODS
from common.runtime.service import HEALTH_NS
from common.runtime.specs import Actor, FirstFrames, Images, Rendered, VideoFile
from common.runtime.tracker_table import TrackerError, Wanted, chosen
from common.take.opening import new_recording
from common.take.recording import Recording
from common.topics import TOPICS, Topic
from services.takes.offline import Offline
from services.viewer.source import open_source
from services.viewer.sources.frame import Frame, Playback, SourceError

logger = logging.getLogger(__name__)

EPOCH_NS = 1_072_915_200_000_000_000  # 2004-01-01, the year of [Two-view]: results do not depend on today
SAME_SHAPE = 0.02


@dataclass(frozen=True)
class Instant:
    """What belongs to one instant: each viewer's frame, everything that was said about it, what is being done."""

    frames: dict[str, Frame]
    said: tuple[Message, ...]
    state: str = ""


@dataclass(frozen=True)
class Tracked:
    """instants: of frames.  poses: universal BAPs, or the tracker's.  problems: what was lost on the way, in words.

    states: what each service was doing at the end.
    """

    instants: int
    poses: int
    messages: int
    problems: tuple[str, ...]
    states: dict[str, str]


def track(rig: Rig, take: Path, watch: Callable[[Instant], None] = lambda _: None) -> Tracked:
    """Write the take of a rig whose sources end.  watch: sees every instant, in order.

    Raises RigError, SourceError before the first frame, RecordingError and ValueError.
    """
    for viewer in rig.viewers:
        if not isinstance(viewer.source, VideoFile | Images | Actor | Rendered):
            raise RigError(f"rig {rig.name}: viewer {viewer.id} is a live camera: allowed for track: files and pictures")
    clock = ManualClock(EPOCH_NS)
    frames = {viewer.id: open_source(viewer, Playback(EPOCH_NS, clock, live=False)) for viewer in rig.viewers}
    return track_frames(rig, frames, clock, take, watch)


def track_frames(
    rig: Rig,
    frames: dict[str, Iterator[Frame]],
    clock: ManualClock,
    take: Path,
    watch: Callable[[Instant], None] = lambda _: None,
    logged: Sequence[Topic] = TOPICS,
) -> Tracked:
    """Write the take of the frames of a rig's viewers, which begin at EPOCH_NS.  clock: is set to their time.

    logged: the topics that the take has.  Raises SourceError before the first frame, RecordingError and ValueError.
    """
    network = LocalNetwork(rig.name, clock)
    offline = Offline(rig, network)
    problems: list[str] = []
    recorder = network.bus()
    for topic in logged:
        recorder.subscribe(topic, every=True)
    instants_of = instants(frames, round(0.5e9 / max(viewer.fps for viewer in rig.viewers)), problems)
    first = next(instants_of, None)
    if first is None or problems:
        raise SourceError("; ".join(problems) or f"rig {rig.name}: its sources have no frames")
    recording = new_recording(rig, take, EPOCH_NS, overwrite=True)
    count = poses = 0
    report_ns = EPOCH_NS + HEALTH_NS
    with closing(recording):
        offline.greet(EPOCH_NS)
        current: dict[str, Frame] | None = first
        while current is not None:
            clock.set(max(frame.captured_ns for frame in current.values()))
            offline.see(current)
            if clock.now_ns() >= report_ns:
                offline.report_handled()
                report_ns += HEALTH_NS
            said = tuple(_record(recorder, recording))
            poses += sum(isinstance(message, UniversalBap | TrackerPose) for message in said)
            count += 1
            watch(Instant(current, said, offline.state()))
            current = next(instants_of, None)
        offline.report_handled()
        _record(recorder, recording)
    written = recording.statistics
    problems += [f"{count} {what}" for what, count in offline.failures().items() if count]
    if written.failure:
        problems.append(f"{written.failure}; {written.lost} messages lost")
    return Tracked(count, poses, written.messages, tuple(problems), offline.states())


def instants(sources: dict[str, Iterator[Frame]], tolerance_ns: int, problems: list[str]) -> Iterator[dict[str, Frame]]:
    """Frames of all viewers grouped by capture time, in order; a source that breaks adds a line to `problems`.

    Frames within `tolerance_ns` of the earliest one belong together.  It ends with the last source.
    """
    waiting: dict[str, Frame] = {}
    ended: set[str] = set()
    while True:
        for id, source in sources.items():
            if id not in waiting and id not in ended:
                try:
                    waiting[id] = next(source)
                except StopIteration:
                    ended.add(id)
                except SourceError as error:
                    ended.add(id)
                    problems.append(str(error))
        if not waiting:
            return
        start_ns = min(frame.captured_ns for frame in waiting.values())
        group = {id: frame for id, frame in waiting.items() if frame.captured_ns - start_ns <= tolerance_ns}
        yield {id: group[id] for id in sources if id in group}
        for id in group:
            del waiting[id]


def at_working_size(rig: Rig, size: tuple[int, int] | None, fps: float | None) -> Rig:
    """The rig with every viewer's working size and rate replaced where given.  Raises RigError.

    The empty scene at the beginning takes as many seconds as before.
    """
    return replace(rig, viewers=tuple(_resized(rig, viewer, size, fps) for viewer in rig.viewers))


def with_tracker(rig: Rig, wanted: Wanted) -> Rig:
    """The rig with what is wanted instead of its own tracker's.  Raises RigError."""
    if rig.tracker is None:
        if wanted != Wanted():
            raise RigError(
                f"rig {rig.name}: method = {rig.method!r} has no tracker: allowed with "
                f"{', '.join(f'--{name}' for name in vars(wanted))}: {', '.join(TRACKER_METHODS)}"
            )
        return rig
    try:
        spec = chosen(rig.tracker, rig.method, wanted)
    except TrackerError as error:
        raise RigError(f"--{error}") from error
    return replace(rig, tracker=spec)


def of_height(rig: Rig, height: float) -> Rig:
    """The rig for a person of that height in metres, whose body is not measured: no initial posture is shown."""
    viewers = tuple(
        replace(viewer, source=replace(viewer.source, initial=None)) if isinstance(viewer.source, VideoFile) else viewer
        for viewer in rig.viewers
    )
    return replace(rig, viewers=viewers, person_height=height)


def _resized(rig: Rig, viewer: Viewer, size: tuple[int, int] | None, fps: float | None) -> Viewer:
    if size is not None:
        width, height = viewer.calibrated_size
        if abs((size[0] / width) / (size[1] / height) - 1) > SAME_SHAPE:
            raise RigError(
                f"rig {rig.name}: viewer {viewer.id}: size {size[0]}x{size[1]}: allowed: the shape of the calibrated "
                f"{width}x{height} px, such as {size[0]}x{round(size[0] * height / width)}"
            )
        viewer = replace(viewer, camera=viewer.camera.resized(size))
    if fps is None:
        return viewer
    background = viewer.background
    if isinstance(background, FirstFrames) and fps < viewer.fps:  # as long as before, in fewer frames
        background = FirstFrames(max(1, int(background.count * fps / viewer.fps)))
    return replace(viewer, fps=fps, background=background)


def _record(bus: LocalBus, recording: Recording) -> Sequence[Message]:
    said = []
    while (event := bus.receive()) is not None:
        if isinstance(event, Envelope):
            recording.record(event)
            said.append(event.message)
    return said
