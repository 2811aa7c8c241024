"""`zenocap mirror`: front and back exchanged from a time on.

Nothing is relabelled.  At that time the track goes on from the opposite heading, with left and right limbs exchanged, and
all later poses follow from the silhouettes of the take.  The decision is part of the new take's set-up, so that
`zenocap verify` recomputes it.
"""

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import msgspec
from msgspec import UNSET

from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.definition import Bdp
from zenocap.common.conversion import bdp_of, pose_of
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.recording.setup_file import SETUP_FILE, RecordedRig, RecordedTurn, read_setup
from zenocap.common.recording.writer import Recording
from zenocap.common.rig.methods import tracker_methods
from zenocap.common.topics import BOTH_WAYS_POSE, CAMERA, TRACKER_BDP, TRACKER_POSE, topic_at
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.both_ways.passes import BACKWARDS, CHOOSING, Watch
from zenocap.services.tracker.states import TrackerSetup
from zenocap.tools.takes.both_ways import WRITING, with_both_ways
from zenocap.tools.takes.members import tracker_setup
from zenocap.tools.takes.retrack import retrack, take_like

TRACKING = "tracking again"
ACTIVITIES = (TRACKING, BACKWARDS, CHOOSING, WRITING)
WATCHED_NS = 1_000_000_000  # after the exchange, in which it is checked whether the track turns back
READ = (TRACKER_POSE, BOTH_WAYS_POSE, TRACKER_BDP, CAMERA)


@dataclass(frozen=True)
class Mirrored:
    """Result.  from_s, until_s: seconds since frame 0; until_s: None for the end.  turned_back_s: time at which the track
    faces again as in the original, None if it does not within WATCHED_NS."""

    poses: int
    messages: int
    from_s: float
    until_s: float | None
    both_ways: bool
    turned_back_s: float | None


@dataclass
class _ShownPoses:
    """Poses of a take as they are shown, those of both directions where it has them.

    forward, better: of one pass and of both, by capture time: (3,) direction of the front of the pelvis, None where the
    person is lost.  poses: number of all poses.  start_ns: capture time of frame 0.  first_ns: log time of the take.
    """

    forward: dict[int, Floats | None] = field(default_factory=dict)
    better: dict[int, Floats | None] = field(default_factory=dict)
    body: Bdp | None = None
    poses: int = 0
    both_ways: bool = False
    start_ns: int | None = None
    first_ns: int | None = None

    @cached_property
    def fronts(self) -> dict[int, Floats]:
        """Directions by capture time, in its order, only while the person is tracked."""
        return {captured_ns: one for captured_ns, one in sorted((self.forward | self.better).items()) if one is not None}

    def add(self, setup: TrackerSetup, message: m.Message) -> None:
        match message:
            case m.CameraInfo(captured_ns=captured_ns):
                self.start_ns = captured_ns if self.start_ns is None else min(self.start_ns, captured_ns)
            case m.TrackerBdp(body=body):
                self.body = bdp_of(setup.anatomy, body)
            case m.TrackerPose() as pose:  # a BothWaysPose too
                poses = self.better if isinstance(pose, m.BothWaysPose) else self.forward
                self.both_ways = self.both_ways or poses is self.better
                self.poses += poses is self.forward
                if self.body is not None:
                    poses[pose.captured_ns] = None if pose.lost else _front(setup, self.body, pose)


def mirror(
    source: Path, output: Path, from_s: float, until_s: float | None = None, watch: Watch = lambda *_: None, jobs: int = 1
) -> Mirrored:
    """Write the take `source` to `output` with left and right exchanged from `from_s` on, until `until_s` if given.

    from_s, until_s: seconds since frame 0; the next tracked pose counts.  Tracked both ways if the take was.  jobs: number
    of cores, on which the take does not depend.  Equal takes give equal bytes.  Raises UserError and OSError; `output` is
    unchanged then.
    """
    if output.resolve() == source.resolve():
        raise UserError(f"{output}: is the take itself: allowed: another file")
    take = TakeReader(source)
    shown, rig, setup = _read(take)
    assert shown.start_ns is not None
    from_ns = _tracked_at(source, shown, "--from", from_s)
    until_ns = None if until_s is None else _tracked_at(source, shown, "--to", until_s)
    if until_ns is not None and until_ns <= from_ns:
        raise UserError(f"{source}: --to {until_s:g}: allowed: after --from {from_s:g}")
    rig = _turned(rig, shown, from_ns, until_ns)
    setup = _setup_of(rig, take)
    since = [(one - shown.start_ns) / 1e9 for one in (from_ns, until_ns) if one is not None]
    done = {"mirrored": {"from_s": f"{since[0]:.3f}", "source_sha256": _digest(source)}}
    done["mirrored"]["until_s"] = f"{since[1]:.3f}" if until_ns is not None else "end"
    start_ns = shown.first_ns if shown.first_ns is not None else shown.start_ns

    def open_take(path: Path) -> Recording:
        return take_like(take, rig, path, start_ns, done)

    count = 0

    def on_message(message: m.Message) -> None:
        nonlocal count
        if isinstance(message, m.TrackerPose):
            count += 1
            watch(TRACKING, count, shown.poses)

    with atomic_file(output.resolve()) as unfinished:
        messages = retrack(source, rig, lambda: open_take(unfinished), on_message).statistics.messages
        if shown.both_ways:
            messages, _ = with_both_ways(unfinished, rig.name, setup, open_take, watch, jobs)
        after, _, _ = _read(TakeReader(unfinished))
    end_ns = min(from_ns + WATCHED_NS, until_ns or from_ns + WATCHED_NS)
    back = [
        captured_ns
        for captured_ns, front in after.fronts.items()
        if from_ns <= captured_ns <= end_ns and captured_ns in shown.fronts and front @ shown.fronts[captured_ns] > 0.0
    ]
    back_s = (min(back) - shown.start_ns) / 1e9 if back else None
    return Mirrored(after.poses, messages, since[0], since[1] if until_ns is not None else None, shown.both_ways, back_s)


def _read(take: TakeReader) -> tuple[_ShownPoses, RecordedRig, TrackerSetup]:
    """The poses of a take, its rig and the set-up of its tracker.  Raises UserError for a take that cannot be mirrored."""
    shown, rig, setup = _ShownPoses(), None, None
    for recorded in take.messages():
        shown.first_ns = recorded.log_ns if shown.first_ns is None else shown.first_ns
        if topic_at(recorded.topic) not in READ or (received := envelope(recorded)) is None:
            continue
        if rig is None or setup is None:
            rig = _rig_of(take)
            setup = _setup_of(rig, take)
        shown.add(setup, received.message)
    if take.cut:
        raise UserError(f"{take.cut}; `zenocap recover` writes a copy that can be read")
    if "part" in take.metadata:
        raise UserError(f"{take.path}: is one part of a take: allowed: takes in one file")
    if rig is None or setup is None or not any(front is not None for front in shown.forward.values()):
        raise UserError(f"{take.path}: no tracked pose in it: there is nothing to mirror")
    shown.start_ns = min(shown.fronts) if shown.start_ns is None else shown.start_ns
    return shown, rig, setup


def _rig_of(take: TakeReader) -> RecordedRig:
    if SETUP_FILE not in take.attachments:
        raise UserError(f"{take.path}: no attachment {SETUP_FILE}: the set-up of its tracker is unknown")
    rig = read_setup(take.path, take.attachments[SETUP_FILE])
    if rig.tracker is None:
        raise UserError(f"{take.path}: method {rig.method!r}: allowed for mirror: {', '.join(tracker_methods())}")
    silent = [viewer.id for viewer in rig.viewers if not viewer.silhouette]
    if silent:
        raise UserError(f"{take.path}: no silhouettes of {', '.join(silent)}: they are needed to track again")
    return rig


def _setup_of(rig: RecordedRig, take: TakeReader) -> TrackerSetup:
    try:
        return tracker_setup(rig, take.path, take.attachments)
    except ValueError as error:
        raise UserError(f"{take.path}: {error}") from error


def _front(setup: TrackerSetup, body: Bdp, pose: m.TrackerPose | m.BothWaysPose) -> Floats:
    """(3,) unit vector along which the pelvis faces."""
    front: Floats = RootedPose.of(setup.anatomy, body, pose_of(setup.anatomy, pose)).rotation[:, 2]
    return front


def _tracked_at(source: Path, shown: _ShownPoses, option: str, seconds: float) -> int:
    """Capture time of the first tracked pose at or after a time.  Raises UserError."""
    assert shown.start_ns is not None
    wanted_ns = shown.start_ns + round(seconds * 1e9)
    found = next((captured_ns for captured_ns in shown.fronts if captured_ns >= wanted_ns - 1000), None)
    if found is None:
        first, last = ((one - shown.start_ns) / 1e9 for one in (min(shown.fronts), max(shown.fronts)))
        raise UserError(
            f"{source}: {option} {seconds:g}: no tracked pose from there on: allowed: {first:.3f} to {last:.3f}, seconds "
            "since frame 0"
        )
    return found


def _turned(rig: RecordedRig, shown: _ShownPoses, from_ns: int, until_ns: int | None) -> RecordedRig:
    """The rig whose track is turned round at `from_ns`, and back at `until_ns`; earlier turns at other times stay."""
    assert rig.tracker is not None
    turns = {} if rig.tracker.turns is UNSET else {one.captured_ns: one for one in rig.tracker.turns}
    fronts = {from_ns: -shown.fronts[from_ns]} | ({} if until_ns is None else {until_ns: shown.fronts[until_ns]})
    for captured_ns, front in fronts.items():
        x, y, z = front.tolist()
        turns[captured_ns] = RecordedTurn(captured_ns=captured_ns, front=(x, y, z))
    tracker = msgspec.structs.replace(rig.tracker, turns=[turns[captured_ns] for captured_ns in sorted(turns)])
    return msgspec.structs.replace(rig, tracker=tracker)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
