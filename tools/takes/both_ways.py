"""Second pass of `zenocap track`: backwards over the silhouettes, and the better poses of both.

The take of the forward pass is complete before the second pass begins, and stays until the take with the poses of both
passes is complete and replaces it.  The silhouettes are read from the take, a chunk at a time; in memory are the poses.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from mcap.reader import SeekingReader

from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.definition import Bdp
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import angles_by_name, bdp_of, pose_of, silhouette_mask
from zenocap.common.errors import UserError
from zenocap.common.recording.opening import new_recording
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import recorded_rig
from zenocap.common.recording.writer import Recording, RecordingError
from zenocap.common.rig.methods import METHODS, method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.session.lookahead import available_cores
from zenocap.common.topics import BOTH_WAYS_POSE, SILHOUETTE, TRACKER_BDP, TRACKER_POSE
from zenocap.services.tracker.both_ways.fusion import SECTIONS
from zenocap.services.tracker.both_ways.passes import ForwardPose, FusedPose, SceneMasks, Watch, two_passes
from zenocap.services.tracker.filter.confidence import LIMBS, Confidence
from zenocap.services.tracker.parameters import LOST_LIMB
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.shell import setup_of
from zenocap.services.tracker.states import TrackerSetup
from zenocap.tools.parameters import EPOCH_NS, service_parameters
from zenocap.tools.takes.take_writer import TakeWriter
from zenocap.tools.takes.track import Tracked, TrackedFrameSet, track

WRITING = "writing the take"
WAIT_FRAMES = 3  # frame periods by which silhouettes may be recorded out of the order of their capture; by hand


def has_second_pass(rig: Rig, wanted: bool | None = None) -> bool:
    """Whether a rig is tracked both ways.  wanted: by the user; None: with the method hybrid, unless as printed.

    Raises UserError when a second pass is wanted of a rig without tracker.
    """
    possible = method_of(rig.method).second_pass
    if wanted and possible == "never":
        allowed = ", ".join(name for name, one in METHODS.rows().items() if one.second_pass != "never")
        raise UserError(f"rig {rig.name}: method = {rig.method!r}: allowed with --both-ways: {allowed}")
    # The paper's baselines, and the method as printed, have one pass.
    default = possible == "default" and (rig.tracker is None or rig.tracker.preset == "default")
    return default if wanted is None else wanted


def track_both_ways(
    rig: Rig, take: Path, on_frame_set: Callable[[TrackedFrameSet], None] = lambda _: None, watch: Watch = lambda *_: None,
    jobs: int | None = None, on_repeat: Callable[[float], None] = lambda _: None,
) -> Tracked:  # fmt: skip
    """As `track`, and a `BothWaysPose` in the take for every pose.  watch: called with the progress after the first pass.

    When the second pass is interrupted or fails, the take is that of the forward pass; a failure is one of the problems.
    Raises UserError for a rig without tracker, and as `track`.
    """
    has_second_pass(rig, True)
    jobs = available_cores() if jobs is None else jobs
    result = track(rig, take, on_frame_set, jobs, on_repeat)
    if not result.poses or not result.complete:
        return result
    try:
        messages, verdict = add_both_ways(result.rig_of(rig), take, watch, jobs)
    except (UserError, OSError) as error:
        text = f"second pass: {error}; the poses are those of the forward pass"
        return replace(result, problems=(*result.problems, text))
    return replace(result, messages=messages, both_ways=True, verdict=verdict)


def add_both_ways(rig: Rig, take: Path, watch: Watch = lambda *_: None, jobs: int = 1) -> tuple[int, m.Verdict]:
    """Replace a take of the forward pass by one with the poses of both passes; return its number of messages and verdict.

    Raises UserError, OSError and RecordingError; the take is unchanged then.
    """
    recorded = recorded_rig(rig)
    prior_file = rig.tracker.prior if rig.tracker else None
    prior = None if prior_file is None else read_prior(prior_file, recorded.anatomy())
    setup = setup_of(recorded, prior)

    def open_take(path: Path) -> Recording:
        return new_recording(rig, path, EPOCH_NS, service_parameters(rig), overwrite=True)

    return with_both_ways(take, rig.name, setup, open_take, watch, jobs)


def with_both_ways(
    take: Path, rig: str, setup: TrackerSetup, open_take: Callable[[Path], Recording], watch: Watch = lambda *_: None,
    jobs: int = 1,
) -> tuple[int, m.Verdict]:  # fmt: skip
    """As `add_both_ways`.  rig: its name.  open_take: opens a take with the files of `take`."""
    found = both_ways(take, rig, setup, watch, jobs)
    end_ns = EPOCH_NS
    with atomic_file(take.resolve()) as unfinished:
        recording = open_take(unfinished)
        with TakeWriter(recording, rig) as writer:
            written = 0
            for received in TakeReader(take).envelopes(invalid="raise"):
                end_ns = received.received_ns
                if isinstance(received.message, m.Verdict):  # of the forward pass
                    continue
                replaced = isinstance(received.message, m.TrackerPose) and bool(found)
                writer.record(received, converted=not replaced)  # Foxglove channels have the better poses
                if isinstance(received.message, m.TrackerPose) and found:
                    written += 1
                    watch(WRITING, written, len(found))
                    message = both_ways_message(setup, received.message, found[received.message.captured_ns])
                    key, data = BOTH_WAYS_POSE.at(rig), codec.encode(message)
                    writer.record(Envelope(key, BOTH_WAYS_POSE, message, received.received_ns, data))
            verdict = writer.judge(end_ns)
        if recording.failure:
            raise RecordingError(recording.failure)
    return recording.statistics.messages, verdict


def both_ways(
    take: Path, rig: str, setup: TrackerSetup, watch: Watch = lambda *_: None, jobs: int = 1
) -> Mapping[int, FusedPose]:
    """Poses from both directions by capture time, for every pose of the forward pass in a take.  rig: its name.

    jobs: number of cores to use, on which the poses do not depend.  Empty when the person was never tracked.  Raises
    UserError for a file that cannot be read backwards.
    """
    forward, body = _forward_poses(take, setup)
    while_tracked = forward[: 1 + max((k for k, one in enumerate(forward) if not one.lost), default=-1)]
    if body is None or not while_tracked:
        return {}
    return two_passes(setup, body, forward, _scenes_backwards(take, rig, setup, while_tracked), watch, jobs)


def both_ways_message(setup: TrackerSetup, forward: m.TrackerPose, found: FusedPose) -> m.BothWaysPose:
    """Message of a pose from both directions.  forward: of the same frame."""
    x, y, z = found.pose.position.tolist()
    shares = dict(zip(SECTIONS, np.round(found.shares, 3).tolist(), strict=True))
    ahead = Confidence(forward.limbs, forward.heading)
    taken = {section: ahead if share < 0.5 else found.confidence or ahead for section, share in shares.items()}
    limbs = {limb: taken[limb].limbs[limb] for limb in LIMBS if limb in taken[limb].limbs}
    return m.BothWaysPose(
        frame=forward.frame, captured_ns=forward.captured_ns, position=(x, y, z),
        angles=angles_by_name(setup.anatomy, found.pose.angles), position_spread=forward.position_spread,
        spread=forward.spread, likelihood=forward.likelihood, effective=forward.effective, lost=found.lost,
        views=forward.views, limbs=limbs, lost_limbs=[limb for limb, score in limbs.items() if score < LOST_LIMB],
        heading=taken["trunk"].heading, backward=shares,
    )  # fmt: skip


def _forward_poses(take: Path, setup: TrackerSetup) -> tuple[Sequence[ForwardPose], Bdp | None]:
    """Poses by capture time, and the last body."""
    poses: dict[int, ForwardPose] = {}
    views: dict[tuple[str, ...], tuple[str, ...]] = {}  # equal ones are stored once
    body: Bdp | None = None
    for received in TakeReader(take).envelopes((TRACKER_POSE, TRACKER_BDP), invalid="raise"):
        match received.message:
            case m.TrackerPose() as one:
                used = views.setdefault(tuple(one.views), tuple(one.views))
                pose = pose_of(setup.anatomy, one)
                stated = Confidence(one.limbs, one.heading)
                poses[one.captured_ns] = ForwardPose(one.captured_ns, pose, one.lost, used, stated)
            case m.TrackerBdp(body=found):
                body = bdp_of(setup.anatomy, found)
    return [poses[captured_ns] for captured_ns in sorted(poses)], body


def _scenes_backwards(take: Path, rig: str, setup: TrackerSetup, forward: Sequence[ForwardPose]) -> Iterator[SceneMasks]:
    """Yield every pose, the last first, with the masks of the views that it used, by viewer.

    A frozen view is left out from its first equal picture on; the forward pass left it out after some.  Raises UserError
    for a file without silhouettes, or without the index that is needed to read it backwards.
    """
    waiting: dict[tuple[str, int], m.Silhouette] = {}
    left_out: dict[str, m.Silhouette] = {}  # by viewer, of the next pose
    at = len(forward) - 1
    for silhouette in chain(_silhouettes_backwards(take, rig, setup), [None]):
        while at >= 0 and (
            silhouette is None or silhouette.captured_ns < forward[at].captured_ns - WAIT_FRAMES * setup.frame_ns
        ):
            pose = forward[at]
            masks: dict[str, Mask] = {}
            for (viewer, captured_ns), one in waiting.items():
                if abs(captured_ns - pose.captured_ns) <= setup.frame_ns // 2:
                    later = left_out.pop(viewer, None)
                    if viewer not in pose.views or (later and (later.region, later.data) == (one.region, one.data)):
                        left_out[viewer] = one
                    else:
                        masks[viewer] = silhouette_mask(one)
            yield pose, {viewer: masks[viewer] for viewer in setup.cameras if viewer in masks}
            waiting = {key: one for key, one in waiting.items() if key[1] < pose.captured_ns - setup.frame_ns // 2}
            at -= 1
        if silhouette is not None:
            waiting[silhouette.viewer, silhouette.captured_ns] = silhouette


def _silhouettes_backwards(take: Path, rig: str, setup: TrackerSetup) -> Iterator[m.Silhouette]:
    """Silhouettes, the last first; a chunk of the file is in memory at a time."""
    keys = [SILHOUETTE.at(rig, viewer=viewer) for viewer in setup.cameras]
    with take.open("rb") as file:
        reader = SeekingReader(file)
        summary = reader.get_summary()
        if summary is None or not summary.chunk_indexes:
            raise UserError(f"{take}: no index: it cannot be read backwards; `zenocap recover` writes a copy with one")
        if not any(channel.topic in keys for channel in summary.channels.values()):
            raise UserError(f"{take}: no silhouettes: they are needed for a second pass")
        for _, _, recorded in reader.iter_messages(topics=keys, reverse=True):
            message = codec.decode(recorded.data, m.Silhouette)
            assert isinstance(message, m.Silhouette)
            yield message
