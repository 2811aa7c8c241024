"""`zenocap track`: the services of a rig on every frame of its files, without network.

Time is that of the frames, so that two runs give equal bytes.
"""

import logging
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import cast

import numpy as np

from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.bus.protocol import Envelope
from zenocap.common.camera_advice import TakeAdvice, TakeFault
from zenocap.common.conversion import anatomy_of, bdp_of
from zenocap.common.errors import SourceError, UserError
from zenocap.common.messages import CameraAdvice, Message, Silhouette, TrackerBdp, UniversalBdp, Verdict
from zenocap.common.recording.opening import new_recording
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import VIDEO_NOTES, recorded_rig
from zenocap.common.rig.methods import HYBRID, method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import MAIN
from zenocap.common.rig.tracker import TrackerTable, tracker_spec
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import HEALTH_NS, Service
from zenocap.common.session.lookahead import Lookahead, available_cores, limited_threads
from zenocap.common.session.session import Session
from zenocap.common.topics import CAMERA, SILHOUETTE, TOPICS, TRACKER_BDP, VERDICT, Topic
from zenocap.services.tracker import shell as tracker_shell
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.parameters import EPOCH_NS, service_parameters
from zenocap.tools.takes.inputs import Inputs
from zenocap.tools.takes.members import cameras, members
from zenocap.tools.takes.take_writer import TakeWriter

WAITED_SHARE = 0.05  # of the frame sets, before the first pose: more is worth a second run; chosen by hand

logger = logging.getLogger(__name__)


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
    states: of each service at the end, in words.  measured: False for a body of average proportions, whose
    estimated: first height (m) then is that of the visual hull over the floor; None for other bodies.
    height: of the body that was measured in the T-pose (m); None without one.
    complete: False when the take could not be written to its end.  both_ways: True when the take has the poses of two
    passes.  notes: what was unusual about the videos, in words.  left_out: frames that were not used, in words.
    waited: frame sets with the person in view before the first pose.  repeated: whether these were tracked again.
    initial: frame sets of separate videos of the T-pose.
    verdict: on the take; None where it could not be written.  advice: faults of the cameras' images, the worst first.
    """

    frame_sets: int
    poses: int
    messages: int
    problems: tuple[str, ...]
    states: dict[str, str]
    measured: bool = True
    estimated: float | None = None
    complete: bool = True
    both_ways: bool = False
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    verdict: Verdict | None = None
    advice: tuple[TakeFault, ...] = ()
    waited: int = 0
    repeated: bool = False
    initial: int = 0
    height: float | None = None

    def rig_of(self, rig: Rig) -> Rig:
        """The rig with which a take with the height `estimated` was made.  rig: with which it was wanted."""
        seen = rig.person_height is None
        return replace(rig, person_height=self.estimated, height_estimated=seen) if self.repeated else rig


def track(
    rig: Rig, take: Path, on_frame_set: Callable[[TrackedFrameSet], None] = lambda _: None, jobs: int | None = None,
    on_repeat: Callable[[float], None] = lambda _: None,
) -> Tracked:  # fmt: skip
    """Write the take of a rig whose sources end.  on_frame_set: gets every frame set, in order.

    Where no body was measured, the frames are tracked again with the height that the tracker takes from the visual hull
    over the floor: with a tracker where it had waited for more than WAITED_SHARE of them, else where there is no pose.
    A method without a tracker takes a given height likewise, where no T-pose was seen, or late.
    on_repeat: is called with the height (m) before.  The take of the first time stays until the second one is complete, and
    where that is not, or has fewer poses.
    jobs: number of cores to use, on which the take does not depend; default: the available ones.
    Raises UserError, SourceError before the first frame, RecordingError and ValueError.
    """
    for viewer in rig.viewers:
        if not viewer.source.ends:
            raise UserError(f"rig {rig.name}: viewer {viewer.id} is a live camera: allowed for track: files and pictures")
    jobs = available_cores() if jobs is None else jobs
    given, has_tracker = rig.person_height, method_of(rig.method).has_tracker
    result = _tracked(rig if has_tracker else replace(rig, person_height=None), take, on_frame_set, jobs)
    if not result.complete or (has_tracker and given is not None):
        return result
    if has_tracker or given is not None:
        late = not result.poses or result.waited > WAITED_SHARE * result.frame_sets
        height = (given or result.estimated) if late else None
    else:
        height = None if result.poses else height_over_floor(rig, take)
    if height is None:
        return result
    on_repeat(height)
    wanted = replace(result, estimated=height, repeated=True)
    with atomic_file(take.resolve()) as unfinished:
        again = _tracked(wanted.rig_of(rig), unfinished, on_frame_set, jobs)
        if not again.complete or again.poses < result.poses:
            shutil.copyfile(take, unfinished)
            return result
    return replace(again, measured=has_tracker and again.measured, estimated=height, repeated=True)


def _tracked(rig: Rig, take: Path, on_frame_set: Callable[[TrackedFrameSet], None], jobs: int) -> Tracked:
    clock, inputs = ManualClock(EPOCH_NS), Inputs()
    result = track_frames(rig, opened(rig, clock, inputs), clock, take, on_frame_set, jobs=jobs, inputs=inputs)
    return replace(result, notes=tuple(inputs.notes()), left_out=tuple(inputs.left_out()))


def height_over_floor(rig: Rig, take: Path) -> float | None:
    """Height of the person in the silhouettes of a take of `rig`, m, as the tracker finds it; None where it finds none."""
    spec = tracker_spec(TrackerTable(), HYBRID.name, False, rig.base)
    setup = tracker_shell.setup_of(recorded_rig(replace(rig, method=HYBRID.name, tracker=spec)), None)
    tracker = cast("Service[object, object, Frame]", tracker_shell.service_of(setup))
    session = Session(rig.name, ManualClock(EPOCH_NS), [tracker], (TRACKER_BDP,))
    for silhouette in TakeReader(take).envelopes((SILHOUETTE,), invalid="raise"):
        for found in session.replay(silhouette):
            if isinstance(found.message, TrackerBdp):
                return _height(found.message)
    return None


def opened(rig: Rig, clock: ManualClock, inputs: Inputs) -> dict[str, Iterator[Frame]]:
    """Frames of the files of a rig by viewer, which begin at EPOCH_NS.  inputs: gets what the videos are."""
    return {
        viewer.id: open_source(
            viewer, Playback(EPOCH_NS, clock, live=False, finished=partial(inputs.videos.__setitem__, viewer.id))
        )
        for viewer in rig.viewers
    }


def track_frames(
    rig: Rig, frames: dict[str, Iterator[Frame]], clock: ManualClock, take: Path,
    on_frame_set: Callable[[TrackedFrameSet], None] = lambda _: None, logged: Sequence[Topic] = TOPICS, jobs: int = 1,
    inputs: Inputs | None = None,
) -> Tracked:  # fmt: skip
    """Write the take of the frames of a rig's viewers, which begin at EPOCH_NS.  clock: is set to their time.

    logged: topics of the take.  jobs: as of `track`.  inputs: counts the frames.  Raises SourceError before the first
    frame, RecordingError and ValueError.
    """
    inputs = Inputs() if inputs is None else inputs
    with limited_threads(jobs), Lookahead(jobs) as lookahead:
        session = Session(rig.name, clock, members(rig), logged)
        sources = {id: lookahead.ahead(session.ahead(id, source)) for id, source in frames.items()}
        groups = inputs.frame_sets(sources, tolerance_ns(rig))
        first = next(groups, None)
        if first is None or inputs.problems:
            raise SourceError("; ".join(inputs.problems) or f"rig {rig.name}: its sources have no frames")
        recording = new_recording(rig, take, EPOCH_NS, service_parameters(rig), overwrite=True)
        recording.closing = lambda: {VIDEO_NOTES: notes} if (notes := inputs.video_notes()) else {}
        count, poses, initial, measured, method = 0, 0, 0, True, method_of(rig.method)
        estimated: float | None = None
        standing: float | None = None
        advice, verdict, waited = TakeAdvice(), None, 0
        report_ns = EPOCH_NS + HEALTH_NS
        with TakeWriter(recording, rig.name) as writer:
            for camera in cameras(rig, EPOCH_NS):
                session.publish(camera)
            for current in chain([first], groups):
                received = [*session.frames(current)]
                if clock.now_ns() >= report_ns:
                    received += session.report()
                    report_ns += HEALTH_NS
                messages = _record(received, writer)
                for message in messages:
                    if isinstance(message, CameraAdvice):
                        advice.add(message)
                poses += sum(type(message) is method.poses.message for message in messages)
                waited += not poses and sum(isinstance(one, Silhouette) and one.region[2] > 0 for one in messages) > 1
                for message in messages:
                    if isinstance(message, TrackerBdp):
                        measured, estimated = message.measured, estimated or _height(message)
                        standing = standing or (_height(message) if measured else None)
                    elif isinstance(message, UniversalBdp) and rig.person_height is None:
                        standing = standing or _height(message)
                count += 1
                initial += all(frame.initial for frame in current.values())
                state = session.describe((method.pose_service, MAIN))
                on_frame_set(TrackedFrameSet(current, messages, state))
            _record(session.report(), writer)
            if VERDICT in logged:
                verdict = writer.judge(clock.now_ns())
    written = recording.statistics
    problems = inputs.problems + [f"{count} {kind}" for kind, count in session.failures().items() if count]
    if written.failure:
        problems.append(f"{written.failure}; {written.lost} messages lost")
    return Tracked(
        count, poses, written.messages, tuple(problems), session.states(), measured,
        None if measured or rig.person_height is not None else estimated, complete=written.failure is None,
        verdict=None if written.failure else verdict, advice=tuple(advice.faults()), waited=waited,
        initial=initial, height=standing,
    )  # fmt: skip


def frame_sets_again(rig: Rig, take: Path, jobs: int | None = None) -> Iterator[TrackedFrameSet]:
    """Yield the frame sets of `track`, decoded again but not processed, with their messages from its take, to draw them.

    jobs: number of cores to use; default: the available ones.  Raises UserError for a take that cannot be read.
    """
    jobs = available_cores() if jobs is None else jobs
    clock, inputs = ManualClock(EPOCH_NS), Inputs()
    with limited_threads(jobs), Lookahead(jobs) as lookahead:
        sources = {id: lookahead.ahead(frames) for id, frames in opened(rig, clock, inputs).items()}
        received = TakeReader(take).envelopes(invalid="raise")
        following = next(received, None)
        for frames in inputs.frame_sets(sources, tolerance_ns(rig)):
            now_ns = max(frame.captured_ns for frame in frames.values())
            clock.set(now_ns)
            messages: list[Message] = []
            # `track` has set its clock to this time; cameras come first, before a separate video of the T-pose.
            while following is not None and (following.topic is CAMERA or following.received_ns <= now_ns):
                messages.append(following.message)
                following = next(received, None)
            yield TrackedFrameSet(frames, tuple(messages))


def tolerance_ns(rig: Rig) -> int:
    """Largest difference of the capture times in a frame set: half a frame period, nanoseconds."""
    return round(0.5e9 / max(viewer.fps for viewer in rig.viewers))


def _height(body: TrackerBdp | UniversalBdp) -> float:
    """Height of a body from the soles to the top of the head, m; exact for an average one."""
    anatomy = anatomy_of(body.body)
    upright = neutral_pose(anatomy, np.zeros(3))
    average, own = (
        np.ptp(np.concatenate(body_ellipses(one, part_frames(anatomy, one, upright)))[:, 1])
        for one in (average_body(anatomy, 1.0), bdp_of(anatomy, body.body))
    )
    return float(own / average)


def _record(received: Sequence[Envelope], writer: TakeWriter) -> tuple[Message, ...]:
    for one in received:
        writer.record(one)
    return tuple(one.message for one in received)
