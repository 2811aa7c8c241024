"""`zenocap track --both-ways`: a second pass over a take's silhouettes, backwards, and the better poses of both passes.

The silhouettes are read from the take, a chunk at a time; in memory are the poses, about 4 kB a frame.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from mcap.reader import SeekingReader

from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import angles_by_name, bdp_of
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import pose_of
from zenocap.common.recording.opening import new_recording
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.recording.setup_file import recorded_rig
from zenocap.common.rig.file import TRACKER_METHODS
from zenocap.common.rig.rig import Rig
from zenocap.common.topics import BOTH_WAYS_POSE, SILHOUETTE
from zenocap.common.vision.mask_codec import unpack
from zenocap.services.tracker.body.body_model import model_of
from zenocap.services.tracker.both_ways.backward import Backward, begin, scene_of, step_back, with_fixed_body
from zenocap.services.tracker.both_ways.fusion import SECTIONS, TwoPoses, fused, two_poses
from zenocap.services.tracker.parameters import MIN_VIEWS
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.shell import anatomy_in, setup_of
from zenocap.services.tracker.states import Setup
from zenocap.services.tracker.tracking import rooted_pose
from zenocap.tools.parameters import service_parameters
from zenocap.tools.recordings.track import EPOCH_NS, Tracked, TrackedFrameSet, track

WAIT_FRAMES = 3  # frame periods by which silhouettes may be recorded out of the order of their capture; by hand
Watch = Callable[[int, int], None]


@dataclass(frozen=True)
class ForwardPose:
    """Pose of the forward pass.  views: the viewers that it used."""

    captured_ns: int
    pose: Pose
    lost: bool
    views: tuple[str, ...]


Scene = tuple[ForwardPose, Mapping[str, Mask]]  # masks: by viewer, (height, width), not 0 on the person


@dataclass(frozen=True)
class FusedPose:
    """Pose from both directions.  shares: (sections,) of the backward pass.  lost: in both directions."""

    pose: Pose
    shares: Floats
    lost: bool = False


def track_both_ways(
    rig: Rig,
    take: Path,
    on_frame_set: Callable[[TrackedFrameSet], None] = lambda _: None,
    watch: Watch = lambda *_: None,
    jobs: int | None = None,
) -> Tracked:
    """As `track`, and a `BothWaysPose` in the take for every pose.  watch: called with frames done and their number.

    While it runs, a folder beside the take holds the poses of the forward pass.  Raises UserError for a rig without
    tracker, and as `track`.
    """
    if rig.tracker is None:
        allowed = ", ".join(TRACKER_METHODS)
        raise UserError(f"rig {rig.name}: method = {rig.method!r}: allowed with --both-ways: {allowed}")
    recorded = recorded_rig(rig)
    prior = None if rig.tracker.prior is None else read_prior(rig.tracker.prior, anatomy_in(recorded))
    setup = setup_of(recorded, prior)
    take.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".zenocap-", dir=take.parent) as folder:
        forward = Path(folder) / "forward.mcap"
        result = track(rig, forward, on_frame_set, jobs)
        found = both_ways(forward, rig.name, setup, watch) if result.poses else {}
        recording = new_recording(rig, take, EPOCH_NS, service_parameters(rig), overwrite=True)
        with closing(recording):
            for received in _envelopes(forward):
                replaced = isinstance(received.message, m.TrackerPose) and bool(found)
                recording.record(received, converted=not replaced)  # Foxglove channels have the better poses
                if isinstance(received.message, m.TrackerPose) and found:
                    message = both_ways_message(setup, received.message, found[received.message.captured_ns])
                    key, data = BOTH_WAYS_POSE.at(rig.name), codec.encode(message)
                    recording.record(Envelope(key, BOTH_WAYS_POSE, message, received.received_ns, data))
        written = recording.statistics
    problems = result.problems
    if written.failure:
        problems = (*problems, f"{written.failure}; {written.lost} messages lost")
    return replace(result, messages=written.messages, problems=problems)


def both_ways(take: Path, rig: str, setup: Setup, watch: Watch = lambda *_: None) -> Mapping[int, FusedPose]:
    """Poses from both directions by capture time, for every pose of the forward pass in a take.  rig: its name.

    Empty when the person was never tracked.  Raises UserError for a file that cannot be read backwards.
    """
    forward, body = _forward_poses(take, setup)
    while_tracked = forward[: 1 + max((k for k, one in enumerate(forward) if not one.lost), default=-1)]
    if body is None or not while_tracked:
        return {}
    return fused_poses(setup, body, forward, _scenes_backwards(take, rig, setup, while_tracked), watch)


def fused_poses(
    setup: Setup, body: Bdp, forward: Sequence[ForwardPose], backwards: Iterable[Scene], watch: Watch = lambda *_: None
) -> Mapping[int, FusedPose]:
    """Poses from both directions by capture time, one for each of the forward pass.

    forward: by capture time.  backwards: poses with the masks that they used, from the last tracked one to the first.
    """
    both = _two_poses(with_fixed_body(setup), body, backwards, lambda done: watch(done, len(forward)))
    result: dict[int, FusedPose] = {}
    stretch: list[TwoPoses] = []
    last = next(one.pose for one in forward if not one.lost)
    for one in (*forward, None):
        two = both.pop(one.captured_ns, None) if one is not None else None
        if two is not None:
            stretch.append(two)
            continue
        if stretch:
            for ended, (rooted, shares) in zip(stretch, fused(setup.anatomy, stretch, setup.frame_ns), strict=True):
                last = rooted.pose(setup.anatomy)
                result[ended.captured_ns] = FusedPose(last, shares)
            stretch = []
        if one is not None:  # lost in both directions: the last pose, as the tracker does
            result[one.captured_ns] = FusedPose(last, np.zeros(len(SECTIONS)), lost=True)
    return result


def both_ways_message(setup: Setup, forward: m.TrackerPose, found: FusedPose) -> m.BothWaysPose:
    """Message of a pose from both directions.  forward: of the same frame."""
    x, y, z = found.pose.position.tolist()
    shares = dict(zip(SECTIONS, np.round(found.shares, 3).tolist(), strict=True))
    kept = [limb for limb in forward.limbs if not found.lost and shares[limb] < 0.5]
    return m.BothWaysPose(
        frame=forward.frame, captured_ns=forward.captured_ns, position=(x, y, z),
        angles=angles_by_name(setup.anatomy, found.pose.angles), position_spread=forward.position_spread,
        spread=forward.spread, likelihood=forward.likelihood, effective=forward.effective, lost=found.lost,
        views=forward.views, limbs={limb: forward.limbs[limb] for limb in kept},
        lost_limbs=[limb for limb in forward.lost_limbs if limb in kept],
        heading=forward.heading if shares["trunk"] < 0.5 else None, backward=shares,
    )  # fmt: skip


def _forward_poses(take: Path, setup: Setup) -> tuple[Sequence[ForwardPose], Bdp | None]:
    """Poses by capture time, and the last body."""
    poses: dict[int, ForwardPose] = {}
    views: dict[tuple[str, ...], tuple[str, ...]] = {}  # equal ones are stored once
    body: Bdp | None = None
    for received in _envelopes(take):
        match received.message:
            case m.BothWaysPose():
                pass
            case m.TrackerPose() as one:
                used = views.setdefault(tuple(one.views), tuple(one.views))
                poses[one.captured_ns] = ForwardPose(one.captured_ns, pose_of(setup.anatomy, one), one.lost, used)
            case m.TrackerBdp(body=found):
                body = bdp_of(setup.anatomy, found)
    return [poses[captured_ns] for captured_ns in sorted(poses)], body


def _two_poses(setup: Setup, body: Bdp, backwards: Iterable[Scene], watch: Callable[[int], None]) -> dict[int, TwoPoses]:
    """Poses of both directions by capture time; the backward pass begins with the first of `backwards`."""
    model = model_of(setup.anatomy, body)
    state: Backward | None = None
    found: dict[int, TwoPoses] = {}
    for count, (one, masks) in enumerate(backwards, 1):
        watch(count)
        if len(masks) < MIN_VIEWS:
            continue
        scene = scene_of(setup, masks)
        ahead = None if one.lost else rooted_pose(setup, body, one.pose)
        if state is None:
            state, back = begin(setup, body, one.pose, one.captured_ns, scene), ahead
        else:
            state, back = step_back(setup, state, one.captured_ns, scene)
        two = two_poses(setup.anatomy, model, one.captured_ns, ahead, back, scene)
        if two is not None:
            found[one.captured_ns] = two
    return found


def _scenes_backwards(take: Path, rig: str, setup: Setup, forward: Sequence[ForwardPose]) -> Iterator[Scene]:
    """Yield every pose, the last first, with the masks of the views that it used, by viewer."""
    waiting: dict[tuple[str, int], m.Silhouette] = {}
    at = len(forward) - 1
    for silhouette in chain(_silhouettes_backwards(take, rig, setup), [None]):
        while at >= 0 and (
            silhouette is None or silhouette.captured_ns < forward[at].captured_ns - WAIT_FRAMES * setup.frame_ns
        ):
            pose = forward[at]
            masks: dict[str, Mask] = {}
            for (viewer, captured_ns), one in waiting.items():
                if viewer in pose.views and abs(captured_ns - pose.captured_ns) <= setup.frame_ns // 2:
                    masks[viewer] = unpack(one.size, one.region, one.data)
            yield pose, {viewer: masks[viewer] for viewer in setup.cameras if viewer in masks}
            waiting = {key: one for key, one in waiting.items() if key[1] < pose.captured_ns - setup.frame_ns // 2}
            at -= 1
        if silhouette is not None:
            waiting[silhouette.viewer, silhouette.captured_ns] = silhouette


def _silhouettes_backwards(take: Path, rig: str, setup: Setup) -> Iterator[m.Silhouette]:
    """Silhouettes, the last first; a chunk of the file is in memory at a time."""
    keys = [SILHOUETTE.at(rig, viewer=viewer) for viewer in setup.cameras]
    with take.open("rb") as file:
        reader = SeekingReader(file)
        summary = reader.get_summary()
        if summary is None or not summary.chunk_indexes:
            raise UserError(f"{take}: no index: it cannot be read backwards; `zenocap recover` writes a copy with one")
        for _, _, recorded in reader.iter_messages(topics=keys, reverse=True):
            message = codec.decode(recorded.data, m.Silhouette)
            assert isinstance(message, m.Silhouette)
            yield message


def _envelopes(take: Path) -> Iterator[Envelope]:
    for recorded in Take(take).messages():
        received = envelope(recorded)
        if received is not None:
            yield received
