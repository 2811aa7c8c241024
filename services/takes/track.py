"""`zenocap track`: the viewers and the integrator of a rig over every frame of its files, in one process, without network.

The very same steps as live, in a fixed order: frame k of every viewer, then all that follows from it, until nobody has
more to say.  Time is the frames' own, so that two runs give equal bytes.
"""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Never, TypeVar

from common.bus.local import LocalBus, LocalNetwork
from common.bus.protocol import Envelope, FrameLike, RoundTrip
from common.messages import Message, UniversalBap
from common.runtime.clock import ManualClock
from common.runtime.rig import Rig, RigError, Viewer
from common.runtime.service import HEALTH_NS, Runner, Service
from common.runtime.specs import Actor, Images, VideoFile
from common.take.opening import new_recording
from common.take.recording import Recording
from common.topics import TOPICS
from services.integrator import states as integrator_states
from services.integrator.shell import integrator_service
from services.viewer import states as viewer_states
from services.viewer.shell import camera_info, viewer_service
from services.viewer.source import open_source
from services.viewer.sources.frame import Frame, Playback, SourceError

logger = logging.getLogger(__name__)

EPOCH_NS = 1_072_915_200_000_000_000  # 2004-01-01, the year of [Two-view]: results do not depend on today
SAME_SHAPE = 0.02
Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)
ViewerRunner = Runner[viewer_states.Setup, viewer_states.State, Frame]
IntegratorRunner = Runner[integrator_states.Setup, integrator_states.State, Never]


@dataclass(frozen=True)
class Instant:
    """What belongs to one instant: each viewer's frame, and everything that was said about it."""

    frames: dict[str, Frame]
    said: tuple[Message, ...]


@dataclass(frozen=True)
class Tracked:
    """instants: of frames.  poses: universal BAPs.  problems: what was lost on the way, in words.

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
        if not isinstance(viewer.source, VideoFile | Images | Actor):
            raise RigError(f"rig {rig.name}: viewer {viewer.id} is a live camera: allowed for track: files and pictures")
    clock = ManualClock(EPOCH_NS)
    network = LocalNetwork(rig.name, clock)
    offline = Offline(rig, network)
    problems: list[str] = []
    recorder = network.bus()
    for topic in TOPICS:
        recorder.subscribe(topic, every=True)
    frames = {viewer.id: open_source(viewer, Playback(EPOCH_NS, clock, live=False)) for viewer in rig.viewers}
    instants_of = instants(frames, round(0.5e9 / max(viewer.fps for viewer in rig.viewers)), problems)
    first = next(instants_of, None)
    if first is None or problems:
        raise SourceError("; ".join(problems) or f"rig {rig.name}: its sources have no frames")
    recording = new_recording(rig, take, EPOCH_NS, overwrite=True)
    count = poses = 0
    report_ns = EPOCH_NS + HEALTH_NS
    with closing(recording):
        offline.greet()
        current: dict[str, Frame] | None = first
        while current is not None:
            clock.set(max(frame.captured_ns for frame in current.values()))
            offline.see(current)
            if clock.now_ns() >= report_ns:
                offline.report_handled()
                report_ns += HEALTH_NS
            said = tuple(_record(recorder, recording))
            poses += sum(isinstance(message, UniversalBap) for message in said)
            count += 1
            watch(Instant(current, said))
            current = next(instants_of, None)
        offline.report_handled()
        _record(recorder, recording)
    written = recording.statistics
    problems += [f"{count} {what}" for what, count in offline.failures().items() if count]
    if written.failure:
        problems.append(f"{written.failure}; {written.lost} messages lost")
    return Tracked(count, poses, written.messages, tuple(problems), offline.states())


class Offline:
    """The services of a rig on a network inside this process."""

    def __init__(self, rig: Rig, network: LocalNetwork) -> None:
        """Raises as `viewer_service` and `integrator_service` do."""
        self._rig = rig
        self._viewers: dict[str, ViewerRunner] = {
            viewer.id: _runner(viewer_service(viewer), network) for viewer in rig.viewers
        }
        self._integrator: IntegratorRunner = _runner(integrator_service(rig), network)

    def greet(self) -> None:
        for viewer in self._rig.viewers:
            self._viewers[viewer.id].publish(camera_info(viewer, EPOCH_NS))

    def see(self, frames: dict[str, Frame]) -> None:
        """The frames of one instant, in the rig's order, and all that follows from them."""
        for id, runner in self._viewers.items():
            if id in frames:
                runner.handle(frames[id])
        while any([_drain(self._integrator), *map(_drain, self._viewers.values())]):
            pass

    def report_handled(self) -> None:
        """Let every service say what it was fed."""
        for runner in self._viewers.values():
            runner.report_handled()
        self._integrator.report_handled()

    def states(self) -> dict[str, str]:
        """What each service is doing, in words."""
        runners = {f"viewer {id}": runner.service.describe(runner.state) for id, runner in self._viewers.items()}
        return runners | {"integrator": self._integrator.service.describe(self._integrator.state)}

    def failures(self) -> dict[str, int]:
        """Steps that raised and messages that may not be sent, in words."""
        meters = [self._integrator.meter, *(runner.meter for runner in self._viewers.values())]
        kinds = {"steps failed": "step_errors", "messages could not be sent": "unsendable"}
        return {words: sum(meter.counts[count] for meter in meters) for words, count in kinds.items()}


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
    """The rig with every viewer's working size and rate replaced where given.  Raises RigError."""
    return replace(rig, viewers=tuple(_resized(rig, viewer, size, fps) for viewer in rig.viewers))


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
    return viewer if fps is None else replace(viewer, fps=fps)


def _runner(service: Service[Setup, State, F], network: LocalNetwork) -> Runner[Setup, State, F]:
    runner = Runner(service, network.bus(), network.clock)
    runner.subscribe()
    return runner


def _drain(runner: Runner[Setup, State, F]) -> bool:
    """Handle everything that has come; whether there was anything."""
    any_event = False
    while (event := runner.bus.receive(0.0)) is not None:
        any_event = True
        if not isinstance(event, RoundTrip):
            runner.handle(event)
    return any_event


def _record(bus: LocalBus, recording: Recording) -> Sequence[Message]:
    said = []
    while (event := bus.receive()) is not None:
        if isinstance(event, Envelope):
            recording.record(event)
            said.append(event.message)
    return said
