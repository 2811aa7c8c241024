"""Takes of simulated people with faults, and the true joint centres."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.cases.verdict.faults import FAULTS, FaultyScene, Masks
from benchmarks.harness.case import SHARED
from benchmarks.people.captured import captured_take
from benchmarks.people.films import motion_file
from benchmarks.people.session import rig_of, stepped, tracker_of
from benchmarks.people.simulated_clips import SimulatedClip, captured_clip, simulated_clip
from tests.support.built_messages import silhouette
from tests.support.foxglove_reader import in_envelope
from tests.support.stored import stored
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.conversion import bdp_of, pose_of
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.session.session import Session
from zenocap.common.topics import TOPICS
from zenocap.services.tracker.both_ways.passes import ForwardPose, SceneMasks, two_passes
from zenocap.services.tracker.states import Options, TrackerSetup
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.simulation.body.person import person
from zenocap.simulation.body.skeleton import Bones
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.both_ways import both_ways_message
from zenocap.tools.takes.members import cameras, members

FPS, LONGEST_S = 25.0, 4.0
MOTIONS = ("02_07", "07_02", "07_05", "10_01")  # other ones than those of the fit
VIEWS = (2, 2, 2, 2, 4, 2, 4, 2, 4, 3, 2, 4)  # cameras of each shot with faults
PLAIN = 16  # shots without a fault
FIRST_PERSON = 400  # of the shots; the coefficients were fitted to persons 300 to 365


@dataclass(frozen=True)
class SeenMotion:
    """A person with a motion of a file, seen by `views` cameras."""

    person: int
    motion: str
    views: int


@dataclass(frozen=True)
class FaultTrial:
    """A shot with a fault.  seed: of the fault and the tracker."""

    shot: SeenMotion
    fault: str
    seed: int


@dataclass(frozen=True)
class FaultyTake:
    """Messages of a take, in their order, and the truth.

    frames: (n,) frame numbers of the truth that are scored.  names: of the joints.  points: (n, joints, 3) metres.
    """

    messages: tuple[m.Message, ...]
    names: tuple[str, ...]
    frames: Ints
    points: Floats


def taken(trial: FaultTrial, method: str = "hybrid") -> FaultyTake:
    """The take of a trial, tracked once."""
    encoded, names, frames, points = stored(lambda: _encoded(trial, method), trial, method, sources=(__name__,))
    return FaultyTake(tuple(codec.decode(data, kind) for kind, data in encoded), names, frames, points)


def _encoded(trial: FaultTrial, method: str) -> tuple[list[tuple[type[m.Message], bytes]], tuple[str, ...], Ints, Floats]:
    clip = clip_of(trial.shot)
    scene = FAULTS[trial.fault](
        scene_of(clip, _beside(trial.shot) if trial.fault == "second person" else {}),
        np.random.default_rng([trial.seed, list(FAULTS).index(trial.fault)]),
    )
    messages = two_view_messages(scene) if method == "two-view" else tracker_messages(scene, trial.seed)
    rows = clip.truth.frames >= clip.motion_from
    encoded = [(type(one), codec.encode(one)) for one in messages]
    return encoded, clip.truth.names, clip.truth.frames[rows], clip.truth.points[rows]


def clip_of(shot: SeenMotion) -> SimulatedClip:
    return captured_clip(shot.person, shot.motion, shot.views, FPS, LONGEST_S)


def scene_of(clip: SimulatedClip, other: Masks) -> FaultyScene:
    """Silhouettes of a clip.  other: of a second person."""
    return FaultyScene(clip.cameras, _masks(clip), other, clip.motion_from, FPS)


def _beside(shot: SeenMotion) -> Masks:
    """Silhouettes of a second person, who performs the motion 0.5 to 1.2 m beside the first."""
    rng = np.random.default_rng([shot.person, shot.views])
    subject, angle = person(shot.person + 1000), rng.uniform(0.0, 2 * np.pi)
    by = rng.uniform(0.5, 1.2) * np.array([np.cos(angle), 0.0, np.sin(angle)])
    take = captured_take(subject, SHARED / motion_file(shot.motion), FPS, longest_s=LONGEST_S)
    poses = [Bones(one.rotation, one.origin + by) for one in take.poses[take.motion_from :: 4] if one is not None]
    slow = [pose for pose in poses for _ in range(4)]  # every fourth pose is rendered: it costs
    film = simulated_clip(subject, poses, 0, FPS / 4, shot.views)
    masks = _masks(film)
    return {view: [one for one in masks[view] for _ in range(4)][: len(slow)] for view in masks}


def _masks(clip: SimulatedClip) -> Masks:
    """By view, one per frame from frame 0 on; empty before the first."""
    first = clip.instants[0].frame
    found = {view: [np.zeros(camera.size[::-1], np.uint8)] * first for view, camera in clip.cameras.items()}
    for instant in clip.instants:
        for view, mask in clip.masks(instant, clip.cameras).items():
            found[view].append(mask)
    return found


def two_view_messages(scene: FaultyScene) -> list[m.Message]:
    """Messages of viewers, which are given the silhouettes, and integrator; the cameras' first."""
    rig = rig_of(scene.cameras, FirstFrames(1), scene.fps, "two-view")
    found: list[m.Message] = list(cameras(rig, EPOCH_NS))
    segmented = (
        {view: SegmentedFrame(k, at_ns, mask if mask.any() else None) for view, mask in masks.items()}
        for k, at_ns, masks in _frames(scene)
    )
    for messages, (k, at_ns, masks) in zip(stepped(rig, segmented), _frames(scene), strict=True):
        found += [silhouette(view, k, at_ns, mask) for view, mask in masks.items()]
        found += messages
    return found


def tracker_messages(scene: FaultyScene, seed: int) -> list[m.Message]:
    """Messages of the cameras and of the tracker on the silhouettes, and after each pose that of both directions."""
    forward = list(_forward(scene, seed))
    setup = TrackerSetup(FOURTEEN_PARTS, scene.cameras, round(1e9 / FPS), None, Options(seed=seed))
    return list(_both_ways(setup, scene, forward))


def _forward(scene: FaultyScene, seed: int) -> Iterator[m.Message]:
    rig = rig_of(scene.cameras, FirstFrames(1), scene.fps, "hybrid", tracker=tracker_of(seed=seed))
    service, *_ = members(rig)
    session = Session(rig.name, ManualClock(EPOCH_NS), [service], TOPICS)
    yield from cameras(rig, EPOCH_NS)
    for k, at_ns, masks in _frames(scene):
        for view, mask in masks.items():
            sent = session.replay(in_envelope(silhouette(view, k, at_ns, mask), rig.name, at_ns))
            yield from (one.message for one in sent if not isinstance(one.message, m.ScenePoints))


def _frames(scene: FaultyScene) -> Iterator[tuple[int, int, Mapping[str, Mask]]]:
    """Number, capture time and silhouettes of each frame from the first on that is recorded."""
    for k in range(scene.first, len(next(iter(scene.masks.values())))):
        yield k, EPOCH_NS + round(k * 1e9 / scene.fps), {view: scene.masks[view][k] for view in scene.cameras}


def _both_ways(setup: TrackerSetup, scene: FaultyScene, forward: Sequence[m.Message]) -> Iterator[m.Message]:
    """The messages of the forward pass, and after each pose that of both directions."""
    poses = [one for one in forward if isinstance(one, m.TrackerPose)]
    bodies = [one for one in forward if isinstance(one, m.TrackerBdp)]
    kept = [ForwardPose(one.captured_ns, pose_of(setup.anatomy, one), one.lost, tuple(one.views)) for one in poses]
    last = max((k for k, one in enumerate(kept) if not one.lost), default=-1)
    if last < 0 or not bodies:
        yield from forward
        return
    frames = {one.captured_ns: one.frame for one in poses}

    def backwards() -> Iterator[SceneMasks]:
        for one in kept[last::-1]:
            k = frames[one.captured_ns]
            yield one, {view: scene.masks[view][k] for view in setup.cameras if view in one.views}

    found = two_passes(setup, bdp_of(setup.anatomy, bodies[-1].body), kept, backwards())
    for message in forward:
        yield message
        if isinstance(message, m.TrackerPose):
            yield both_ways_message(setup, message, found[message.captured_ns])


def shots(method: str = "hybrid") -> list[SeenMotion]:
    """Shots with faults; of two-view those with two cameras."""
    every = [SeenMotion(FIRST_PERSON + k, MOTIONS[k % len(MOTIONS)], count) for k, count in enumerate(VIEWS)]
    return [one for one in every if method == "hybrid" or one.views == 2]


def trials(method: str = "hybrid") -> list[FaultTrial]:
    """Every fault of every shot, and more shots of two and four views without a fault."""
    found = [trial_of(shot, name) for shot in shots(method) for name in FAULTS]
    more = [SeenMotion(FIRST_PERSON + 50 + k, MOTIONS[k % len(MOTIONS)], (2, 4)[k % 3 == 2]) for k in range(PLAIN)]
    plain = [trial_of(shot, next(iter(FAULTS))) for shot in more if method == "hybrid" or shot.views == 2]
    return found + plain


def trial_of(shot: SeenMotion, fault: str) -> FaultTrial:
    return FaultTrial(shot, fault, shot.person + 7 * list(FAULTS).index(fault))
