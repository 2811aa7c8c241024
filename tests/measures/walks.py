"""Returns to files already left, along the calls: python -m tests.measures.walks [--calls]

A walk enters a file by a call from another file.  It returns when that file was entered before: a straight pipeline has no
returns.  A call in a loop, or of a view like the one before, counts once.  Calls of kernels from Python count, calls within
compiled code do not.  --calls prints the calls that return.  Exit status 1: a walk has more than its most.
"""

import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from types import CodeType, FrameType

from numba.core.dispatcher import Dispatcher

from tests.golden.make import RING
from tests.support.places import ROOT
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.messages import Silhouette, TrackerBdp, TrackerPose
from zenocap.common.observe.view import RigView
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.writer import Recording
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import AdaptiveBackground
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Stepper
from zenocap.common.topics import SILHOUETTE, TRACKER_BDP, TRACKER_POSE
from zenocap.services.animator import shell as animator
from zenocap.services.animator.page.page_updates import Schedule, due_updates
from zenocap.services.animator.presence import Presence
from zenocap.services.tracker import shell as tracker
from zenocap.services.tracker.filter import filter_step
from zenocap.services.viewer.shell import camera_info, service_of
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source
from zenocap.tools.cli.options import rig_at

TAKE = RING.with_suffix(".mcap")
PACKAGES = tuple(f"{ROOT}/{name}/" for name in ("common", "services", "simulation", "tools"))
FRAMES = 90  # of the camera, most of them to learn the background; frame sets before the traced one


@dataclass
class Walk:
    """Calls from one file into another, in the order of their first occurrence.  returns: callers and callees."""

    stack: list[CodeType] = field(default_factory=list)
    calls: set[tuple[int, int]] = field(default_factory=set)
    entered: set[str] = field(default_factory=set)
    returns: list[str] = field(default_factory=list)

    def call(self, code: CodeType) -> None:
        caller, file = self.stack[-1] if self.stack else None, file_of(code)
        self.stack.append(code)
        if caller is None or file == file_of(caller):
            self.entered.add(file)
        elif (id(caller), id(code)) not in self.calls:
            self.calls.add((id(caller), id(code)))  # code objects change their hash while they run
            if file in self.entered:
                self.returns.append(f"{file_of(caller)}:{caller.co_name} -> {file}:{code.co_name}")
            self.entered.add(file)

    def profile(self, frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if code is _counted.__code__:
            code = frame.f_locals["self"].py_func.__code__
        if event in ("call", "return") and file_of(code):
            if event == "call":
                self.call(code)
            elif self.stack:
                self.stack.pop()


def file_of(code: CodeType) -> str:
    """File of the package, empty for another."""
    name = code.co_filename.replace(f"{ROOT}/zenocap/", f"{ROOT}/")
    return name.removeprefix(f"{ROOT}/") if name.startswith(PACKAGES) else ""


def _counted(self: Dispatcher, *args: object) -> object:
    return super(Dispatcher, self).__call__(*args)


@contextmanager
def traced() -> Iterator[Walk]:
    walk = Walk()
    sys.setprofile(walk.profile)
    try:
        yield walk
    finally:
        sys.setprofile(None)


def message_into_the_log() -> Walk:
    messages = list(islice(TakeReader(TAKE).envelopes((SILHOUETTE,)), 2))
    with tempfile.TemporaryDirectory() as folder:
        recording = Recording(Path(folder) / "take.mcap", rig="demo", start_ns=0)
        recording.record(messages[0])
        with traced() as walk:
            recording.record(messages[1])
        recording.close()
    return walk


def _tracked() -> tuple[Stepper, Iterator[Envelope]]:  # type: ignore[type-arg]
    """The tracker after FRAMES frame sets of the take, and the silhouettes that follow."""
    rig = load_rig(RING)
    stepper = Stepper(tracker.tracker_service(rig))
    silhouettes = TakeReader(TAKE).envelopes((SILHOUETTE,))
    for received in islice(silhouettes, FRAMES * len(rig.viewers)):
        stepper.step(received)
        stepper.step(Tick(received.received_ns))
    return stepper, silhouettes


def filter_of_one_frame_set() -> Walk:
    stepper, silhouettes = _tracked()
    walks: list[Walk] = []
    step = filter_step.filter_step

    def followed(*arguments: object) -> object:
        with traced() as walk:
            found = step(*arguments)  # type: ignore[arg-type]
        walks.append(walk)
        return found

    from zenocap.services.tracker import tracking

    tracking.filter_step = followed  # type: ignore[assignment]
    try:
        for received in silhouettes:
            stepper.step(received)
            stepper.step(Tick(received.received_ns))
            if walks:
                break
    finally:
        tracking.filter_step = step
    return walks[0]


def silhouettes_through_the_tracker() -> Walk:
    stepper, silhouettes = _tracked()
    with traced() as walk:
        for received in silhouettes:
            stepper.step(received)
            if any(isinstance(message, TrackerPose) for message in stepper.step(Tick(received.received_ns))):
                return walk
    raise AssertionError("no pose")


def camera_frame_through_the_viewer() -> Walk:
    rig = load_rig(RING)
    viewer = replace(rig.viewers[0], background=AdaptiveBackground())
    stepper = Stepper(service_of(rig, viewer))
    frames = open_source(viewer, Playback(0, ManualClock(0), live=False))
    for frame in islice(frames, FRAMES):
        stepper.step(frame)
    walks = []
    for frame in list(islice(frames, 8)):  # some parts run with one of them only: the frame with most returns counts
        with traced() as walk:
            assert any(isinstance(message, Silhouette) for message in stepper.step(frame))
        walks.append(walk)
    return max(walks, key=lambda walk: len(walk.returns))


def rig_file_to_a_viewer() -> Walk:
    with traced() as walk:
        rig = rig_at(RING, files=False)
        viewer = rig.viewer("1")
        service_of(rig, viewer)
        camera_info(viewer, 0)
    return walk


def pose_to_the_page() -> Walk:
    stepper = Stepper(animator.animator_service(load_rig(RING)))
    poses = TakeReader(TAKE).envelopes((TRACKER_BDP, TRACKER_POSE))
    schedule, presence = Schedule(), Presence(RigView("ring"))
    for received in poses:
        stepper.step(received)
        schedule, _ = due_updates(schedule, stepper.state, presence, 1, received.received_ns)
        if isinstance(received.message, TrackerPose):
            break
    received = next(
        one for one in poses if isinstance(one.message, TrackerPose) and not isinstance(one.message, TrackerBdp)
    )
    with traced() as walk:
        stepper.step(received)
        due_updates(schedule, stepper.state, presence, 1, received.received_ns)
    return walk


WALKS: dict[str, tuple[int, Callable[[], Walk]]] = {  # the most returns, and the walk
    "message into the log": (1, message_into_the_log),
    "filter step": (14, filter_of_one_frame_set),
    "camera frame through the viewer": (10, camera_frame_through_the_viewer),
    "silhouettes through the tracker": (50, silhouettes_through_the_tracker),
    "rig file to a viewer": (20, rig_file_to_a_viewer),
    "pose to the page": (6, pose_to_the_page),
}


def main(*, calls: bool) -> int:
    Dispatcher.__call__ = _counted
    status = 0
    for name, (most, follow) in WALKS.items():
        walk = follow()
        status |= len(walk.returns) > most
        print(f"{len(walk.returns):4} returns (at most {most}) in {len(walk.entered)} files: {name}", flush=True)
        files = Counter(one.rpartition("-> ")[2].partition(":")[0] for one in walk.returns)
        print("     " + ", ".join(f"{file} {count}" for file, count in files.most_common(6)))
        if calls:
            print("\n".join(f"     {one}" for one in walk.returns))
    return status


if __name__ == "__main__":
    sys.exit(main(calls="--calls" in sys.argv))
