"""`zenocap track`: the services of a rig on every frame of its files, without network.

Time is that of the frames, so that two runs give equal bytes.
"""

import logging
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from zenocap.common.bus.protocol import Envelope
from zenocap.common.camera_advice import TakeAdvice, TakeFault
from zenocap.common.errors import SourceError, UserError
from zenocap.common.messages import CameraAdvice, Message, TrackerBdp, TrackerPose, UniversalBap, Verdict
from zenocap.common.recording.opening import new_recording
from zenocap.common.rig.methods import method_of, tracker_methods
from zenocap.common.rig.rig import Rig, Viewer
from zenocap.common.rig.services import MAIN
from zenocap.common.rig.sources import Actor, Images, Rendered, VideoFile
from zenocap.common.rig.tracker import TrackerError, TrackerOverrides, with_front_of, with_overrides
from zenocap.common.rig.viewers import at_rate
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import HEALTH_NS
from zenocap.common.session.lookahead import Lookahead, limited_threads
from zenocap.common.session.session import Session
from zenocap.common.topics import TOPICS, VERDICT, Topic
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.parameters import EPOCH_NS, service_parameters
from zenocap.tools.recordings.inputs import Inputs
from zenocap.tools.recordings.members import cameras, members
from zenocap.tools.recordings.take_writer import TakeWriter

logger = logging.getLogger(__name__)

SAME_SHAPE = 0.02


@dataclass(frozen=True)
class TrackedFrameSet:
    """One frame set: each viewer's frame, all resulting messages, and the state of the tracking in words."""

    frames: dict[str, Frame]
    messages: tuple[Message, ...]
    state: str = ""


@dataclass(frozen=True)
class Tracked:
    """Result of tracking.

    frame_sets: number of frame sets.  poses: of the integrator or tracker.  problems: losses in words.
    states: of each service at the end, in words.  measured: False for a body of average proportions.
    complete: False when the take could not be written to its end.  both_ways: True when the take has the poses of two
    passes.  notes: what was unusual about the videos, in words.  left_out: frames that were not used, in words.
    verdict: on the take; None where it could not be written.  advice: faults of the cameras' images, the worst first.
    """

    frame_sets: int
    poses: int
    messages: int
    problems: tuple[str, ...]
    states: dict[str, str]
    measured: bool = True
    complete: bool = True
    both_ways: bool = False
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    verdict: Verdict | None = None
    advice: tuple[TakeFault, ...] = ()


def track(
    rig: Rig, take: Path, on_frame_set: Callable[[TrackedFrameSet], None] = lambda _: None, jobs: int | None = None
) -> Tracked:
    """Write the take of a rig whose sources end.  on_frame_set: gets every frame set, in order.

    jobs: number of cores to use, on which the take does not depend; default: the available ones.
    Raises UserError, SourceError before the first frame, RecordingError and ValueError.
    """
    for viewer in rig.viewers:
        if not isinstance(viewer.source, VideoFile | Images | Actor | Rendered):
            raise UserError(f"rig {rig.name}: viewer {viewer.id} is a live camera: allowed for track: files and pictures")
    clock, inputs = ManualClock(EPOCH_NS), Inputs()
    jobs = available_cores() if jobs is None else jobs
    result = track_frames(rig, opened(rig, clock, inputs), clock, take, on_frame_set, jobs=jobs, inputs=inputs)
    return replace(result, notes=tuple(inputs.notes()), left_out=tuple(inputs.left_out()))


def opened(rig: Rig, clock: ManualClock, inputs: Inputs) -> dict[str, Iterator[Frame]]:
    """Frames of the files of a rig by viewer, which begin at EPOCH_NS.  inputs: gets what the videos are."""
    return {
        viewer.id: open_source(
            viewer, Playback(EPOCH_NS, clock, live=False, finished=partial(inputs.videos.__setitem__, viewer.id))
        )
        for viewer in rig.viewers
    }


def track_frames(
    rig: Rig,
    frames: dict[str, Iterator[Frame]],
    clock: ManualClock,
    take: Path,
    on_frame_set: Callable[[TrackedFrameSet], None] = lambda _: None,
    logged: Sequence[Topic] = TOPICS,
    jobs: int = 1,
    inputs: Inputs | None = None,
) -> Tracked:
    """Write the take of the frames of a rig's viewers, which begin at EPOCH_NS.  clock: is set to their time.

    logged: topics of the take.  jobs: as of `track`.  inputs: counts the frames.  Raises SourceError before the first
    frame, RecordingError and ValueError.
    """
    with limited_threads(jobs), Lookahead(jobs) as lookahead:
        return _track_frames(rig, frames, clock, take, on_frame_set, logged, lookahead, inputs or Inputs())


def _track_frames(
    rig: Rig,
    frames: dict[str, Iterator[Frame]],
    clock: ManualClock,
    take: Path,
    on_frame_set: Callable[[TrackedFrameSet], None],
    logged: Sequence[Topic],
    lookahead: Lookahead,
    inputs: Inputs,
) -> Tracked:
    session = Session(rig.name, clock, members(rig), logged)
    sources = {id: lookahead.ahead(session.ahead(id, source)) for id, source in frames.items()}
    groups = inputs.frame_sets(sources, tolerance_ns(rig))
    first = next(groups, None)
    if first is None or inputs.problems:
        raise SourceError("; ".join(inputs.problems) or f"rig {rig.name}: its sources have no frames")
    recording = new_recording(rig, take, EPOCH_NS, service_parameters(rig), overwrite=True)
    count, poses, measured = 0, 0, True
    advice, verdict = TakeAdvice(), None
    report_ns = EPOCH_NS + HEALTH_NS
    with TakeWriter(recording, rig.name) as writer:
        for camera in cameras(rig, EPOCH_NS):
            session.publish(camera)
        current: dict[str, Frame] | None = first
        while current is not None:
            received = [*session.frames(current)]
            if clock.now_ns() >= report_ns:
                received += session.report()
                report_ns += HEALTH_NS
            messages = _record(received, writer)
            for message in messages:
                if isinstance(message, CameraAdvice):
                    advice.add(message)
            poses += sum(isinstance(message, UniversalBap | TrackerPose) for message in messages)
            measured = next((one.measured for one in reversed(messages) if isinstance(one, TrackerBdp)), measured)
            count += 1
            on_frame_set(TrackedFrameSet(current, messages, session.describe((method_of(rig.method).pose_service, MAIN))))
            current = next(groups, None)
        _record(session.report(), writer)
        if VERDICT in logged:
            verdict = writer.judge(clock.now_ns())
    written = recording.statistics
    problems = inputs.problems + [f"{count} {kind}" for kind, count in session.failures().items() if count]
    if written.failure:
        problems.append(f"{written.failure}; {written.lost} messages lost")
    return Tracked(
        count,
        poses,
        written.messages,
        tuple(problems),
        session.states(),
        measured,
        complete=written.failure is None,
        verdict=None if written.failure else verdict,
        advice=tuple(advice.faults()),
    )


def tolerance_ns(rig: Rig) -> int:
    """Largest difference of the capture times in a frame set: half a frame period, nanoseconds."""
    return round(0.5e9 / max(viewer.fps for viewer in rig.viewers))


def available_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def at_working_size(rig: Rig, size: tuple[int, int] | None, fps: float | None) -> Rig:
    """The rig with every viewer's working size and rate replaced where given.  Raises UserError.

    The empty scene at the beginning keeps its duration.
    """
    return replace(rig, viewers=tuple(_resized(rig, viewer, size, fps) for viewer in rig.viewers))


def with_tracker(rig: Rig, overrides: TrackerOverrides) -> Rig:
    """The rig with the given options instead of its own tracker's.  Raises UserError."""
    if rig.tracker is None:
        if overrides != TrackerOverrides():
            raise UserError(
                f"rig {rig.name}: method = {rig.method!r} has no tracker: allowed with "
                f"{', '.join(f'--{name}' for name in vars(overrides))}: {', '.join(tracker_methods())}"
            )
        return rig
    try:
        spec = with_overrides(rig.tracker, rig.method, overrides)
        spec = with_front_of(spec, {viewer.id: viewer.camera.name for viewer in rig.viewers})
    except TrackerError as error:
        raise UserError(f"--{error}") from error
    return replace(rig, tracker=spec)


def decoded_by_hardware(rig: Rig) -> Rig:
    """The rig with its video files decoded by hardware where that is possible."""
    viewers = tuple(
        replace(viewer, source=replace(viewer.source, hardware=True)) if isinstance(viewer.source, VideoFile) else viewer
        for viewer in rig.viewers
    )
    return replace(rig, viewers=viewers)


def with_people(rig: Rig) -> Rig:
    """The rig with the network that finds people in every viewer."""
    return replace(rig, viewers=tuple(replace(viewer, people=True) for viewer in rig.viewers))


def of_height(rig: Rig, height: float) -> Rig:
    """The rig for a person of that height (m) whose body is not measured, for videos without T-pose."""
    viewers = tuple(
        replace(viewer, source=replace(viewer.source, initial=None)) if isinstance(viewer.source, VideoFile) else viewer
        for viewer in rig.viewers
    )
    return replace(rig, viewers=viewers, person_height=height)


def _resized(rig: Rig, viewer: Viewer, size: tuple[int, int] | None, fps: float | None) -> Viewer:
    if size is not None:
        width, height = viewer.calibrated_size
        if abs((size[0] / width) / (size[1] / height) - 1) > SAME_SHAPE:
            raise UserError(
                f"rig {rig.name}: viewer {viewer.id}: size {size[0]}x{size[1]}: allowed: the shape of the calibrated "
                f"{width}x{height} px, such as {size[0]}x{round(size[0] * height / width)}"
            )
        viewer = replace(viewer, camera=viewer.camera.resized(size))
    if fps is None:
        return viewer
    return at_rate(viewer, fps)


def _record(received: Sequence[Envelope], writer: TakeWriter) -> tuple[Message, ...]:
    for one in received:
        writer.record(one)
    return tuple(one.message for one in received)
