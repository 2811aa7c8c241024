"""Takes of simulated people with faults: the tracker's messages on their silhouettes, and the true joint centres.

Takes are kept in a folder, so that a change of the verdict needs no tracking.
"""

import hashlib
import pickle
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from benchmarks.captured import captured_take
from benchmarks.clips import SHARED
from benchmarks.simulated_clip import SIZE, SimulatedClip, simulated_clip
from benchmarks.verdict.faults import FAULTS, Masks, Scene
from benchmarks.verdict.messages import EPOCH_NS, camera_messages, envelope, silhouette
from benchmarks.verdict.two_view import two_view_messages
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.bus.protocol import Tick
from zenocap.common.conversion import bdp_of, pose_of
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.both_ways.passes import ForwardPose, SceneMasks, two_passes
from zenocap.services.tracker.states import Options, Setup
from zenocap.simulation.body.person import person
from zenocap.simulation.body.skeleton import Bones
from zenocap.tools.recordings.both_ways import both_ways_message

FPS, LONGEST_S = 25.0, 4.0
Method = Literal["hybrid", "two-view"]
VERSION = 1  # of the kept takes: to be raised when faults, tracker or simulated people change


@dataclass(frozen=True)
class Shot:
    """A person with a motion of a file, seen by `views` cameras."""

    person: int
    motion: str
    views: int


@dataclass(frozen=True)
class Trial:
    """A shot with a fault.  seed: of the fault and the tracker."""

    shot: Shot
    fault: str
    seed: int


@dataclass(frozen=True)
class FaultyTake:
    """Messages of a take, in their order, and the truth.

    frames: (n,) frame numbers of the truth that are scored.  names: of the joints.  points: (n, joints, 3) metres.
    cpu_s: of tracking, both passes.
    """

    trial: Trial
    messages: tuple[m.Message, ...]
    names: tuple[str, ...]
    frames: Ints
    points: Floats
    cpu_s: float


def taken(trial: Trial, folder: Path, method: Method = "hybrid") -> FaultyTake:
    """The take of a trial, tracked once and kept in `folder`."""
    name = f"{VERSION} {trial}" if method == "hybrid" else f"{VERSION} {trial} {method}"
    digest = hashlib.sha256(name.encode()).hexdigest()[:16]
    path = folder / f"verdict-{digest}.pickle"
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        found = tracked(trial, method)
        kept = (
            [(type(one), codec.encode(one)) for one in found.messages],
            found.names,
            found.frames,
            found.points,
            found.cpu_s,
        )
        part = path.with_suffix(f".{time.time_ns()}")
        part.write_bytes(pickle.dumps(kept))
        part.replace(path)
    encoded, names, frames, points, cpu_s = pickle.loads(path.read_bytes())
    return FaultyTake(trial, tuple(codec.decode(data, kind) for kind, data in encoded), names, frames, points, cpu_s)


def tracked(trial: Trial, method: Method = "hybrid") -> FaultyTake:
    """Track the silhouettes of a trial: by two-view, or forwards and backwards as `zenocap track` does."""
    clip = clip_of(trial.shot)
    scene = FAULTS[trial.fault](
        scene_of(trial.shot, trial.fault == "second person"),
        np.random.default_rng([trial.seed, list(FAULTS).index(trial.fault)]),
    )
    if method == "two-view":
        messages, cpu_s = two_view_messages(scene)
    else:
        setup = Setup(FOURTEEN_PARTS, scene.cameras, round(1e9 / FPS), None, Options(seed=trial.seed))
        started_s = time.process_time()
        messages = list(_both_ways(setup, scene, list(_forward(setup, scene))))
        cpu_s = time.process_time() - started_s
    truth = clip.truth
    rows = truth.frames >= clip.motion_from
    return FaultyTake(trial, tuple(messages), truth.names, truth.frames[rows], truth.points[rows], cpu_s)


@lru_cache(maxsize=2)
def clip_of(shot: Shot) -> SimulatedClip:
    subject = person(shot.person)
    take = captured_take(subject, SHARED / "motions" / f"cmu_{shot.motion}.bvh", FPS, longest_s=LONGEST_S)
    return simulated_clip(f"verdict-{shot.motion}", subject, take.poses, take.motion_from, FPS, shot.views)


def scene_of(shot: Shot, beside: bool = False) -> Scene:
    """Silhouettes of a shot.  beside: of a second person too."""
    clip = clip_of(shot)
    return Scene(clip.cameras, _masks(clip), _beside(shot) if beside else {}, clip.motion_from, FPS)


def _beside(shot: Shot) -> Masks:
    """Silhouettes of a second person, who performs the motion 0.5 to 1.2 m beside the first."""
    rng = np.random.default_rng([shot.person, shot.views])
    subject, angle = person(shot.person + 1000), rng.uniform(0.0, 2 * np.pi)
    by = rng.uniform(0.5, 1.2) * np.array([np.cos(angle), 0.0, np.sin(angle)])
    take = captured_take(subject, SHARED / "motions" / f"cmu_{shot.motion}.bvh", FPS, longest_s=LONGEST_S)
    poses = [Bones(one.rotation, one.origin + by) for one in take.poses[take.motion_from :: 4] if one is not None]
    slow = [pose for pose in poses for _ in range(4)]  # every fourth pose is rendered: it costs
    film = simulated_clip(f"verdict-beside-{shot.motion}", subject, poses, 0, FPS / 4, shot.views)
    masks = _masks(film)
    return {view: [one for one in masks[view] for _ in range(4)][: len(slow)] for view in masks}


def _masks(clip: SimulatedClip) -> Masks:
    """By view, one per frame from frame 0 on; empty before the first."""
    first = clip.instants[0].frame
    nothing = np.zeros(SIZE[::-1], np.uint8)
    found = {view: [nothing] * first for view in clip.cameras}
    for instant in clip.instants:
        for view, mask in clip.masks(instant, clip.cameras).items():
            found[view].append(mask)
    return found


def _forward(setup: Setup, scene: Scene) -> Iterator[m.Message]:
    """Messages of viewers and tracker, the cameras' first."""
    yield from camera_messages(scene)
    state = tracker.initial_state(setup)
    for k in range(max(scene.first, 1), len(next(iter(scene.masks.values())))):
        captured_ns = EPOCH_NS + round(k * 1e9 / FPS)
        for view in scene.cameras:
            one = silhouette(view, k, captured_ns, scene.masks[view][k])
            yield one
            state, _ = tracker.step(setup, state, envelope(one))
        while tracker.pending(state):
            state, messages = tracker.step(setup, state, Tick(captured_ns))
            yield from (one for one in messages if not isinstance(one, m.ScenePoints))


def _both_ways(setup: Setup, scene: Scene, forward: Sequence[m.Message]) -> Iterator[m.Message]:
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


def fitting(shots: int | None = None, method: Method = "hybrid") -> list[Trial]:
    """Trials to which the coefficients are fitted.  shots: number of people with faults; None: all.

    method: two-view takes those with two views.
    """
    every = _trials(300, ("02_04", "02_08", "07_01", "07_03"), (2, 2, 2, 4, 4, 2, 2, 4)[:shots], 0 if shots else 16)
    return _with(every, method)


def held_out(shots: int | None = None, method: Method = "hybrid") -> list[Trial]:
    """Trials of the tables: other people with other motions.  method: as for `fitting`."""
    views = (2, 2, 2, 2, 4, 2, 4, 2, 4, 3, 2, 4)[:shots]
    return _with(_trials(400, ("02_07", "07_02", "07_05", "10_01"), views, 0 if shots else 16), method)


def _with(trials: Sequence[Trial], method: Method) -> list[Trial]:
    return [one for one in trials if method == "hybrid" or one.shot.views == 2]


def _trials(first: int, motions: Sequence[str], views: Sequence[int], plain: int) -> list[Trial]:
    """Every fault of one shot for each of `views`, and `plain` shots of two and four views without a fault."""
    shots = [Shot(first + k, motions[k % len(motions)], count) for k, count in enumerate(views)]
    found = [Trial(shot, name, shot.person + 7 * k) for shot in shots for k, name in enumerate(FAULTS)]
    more = [Shot(first + 50 + k, motions[k % len(motions)], (2, 4)[k % 3 == 2]) for k in range(plain)]
    return found + [Trial(shot, next(iter(FAULTS)), shot.person) for shot in more]
