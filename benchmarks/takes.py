"""Takes of simulated people in colour by the paper's two cameras, with ground truth: postures, or motion capture."""

import hashlib
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import zenocap.simulation
from benchmarks import captured, soma
from benchmarks.captured import captured_take
from benchmarks.soma import SomaPerson
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Bytes
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.body.skeleton import Bones
from zenocap.simulation.ground_truth import Truth, truth
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import posture_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

Size = tuple[int, int]
Subject = Person | SomaPerson

PEOPLE, TAKES = 12, 2
SMALL, LARGE = (160, 120), (640, 480)
FPS, CAPTURED_FPS = 15.0, 30.0
CAPTURED_S = 6.0  # of each motion capture file
VIEWERS = ("1", "2")


@dataclass(frozen=True)
class Take:
    """One repetition (`number`) of a posture by one person.  size: (width, height) px of the images."""

    person: int
    posture: str
    number: int
    size: Size = SMALL
    fps: float = FPS


@dataclass(frozen=True)
class CapturedTake:
    """A simulated person with the motion of a BVH file.  size: (width, height) px of the images."""

    person: int
    motion: Path
    size: Size = SMALL
    fps: float = CAPTURED_FPS


@dataclass(frozen=True)
class Film:
    """images: by viewer, (frames, height, width, 3).  truths: by frame, None while the scene is empty.

    empty: frames of empty scene at the start.  motion_from: the first frame that is scored.
    """

    cameras: Mapping[str, Camera]
    images: Mapping[str, Bytes]
    truths: tuple[Truth | None, ...]
    empty: int
    motion_from: int


def people(people_seed: int, count: int = PEOPLE) -> list[int]:
    """Seeds of the people of one evaluation; those of different `people_seed` are different people."""
    return [PEOPLE * people_seed + k for k in range(count)]


def takes(people_seed: int, count: int = PEOPLE, postures: tuple[str, ...] = POSTURES, size: Size = SMALL) -> list[Take]:
    return [
        Take(person_seed, posture, number, size)
        for person_seed in people(people_seed, count)
        for posture in postures
        for number in range(TAKES)
    ]


def default_folder() -> Path:
    """Folder of rendered frames kept between runs; may be deleted at any time."""
    return Path(tempfile.gettempdir()) / "zenocap-evaluation"


def captured_takes(motions: Sequence[Path], people_seed: int, count: int, size: Size = SMALL) -> list[CapturedTake]:
    return [CapturedTake(seed, motion, size) for seed in people(people_seed, count) for motion in motions]


def film(take: Take | CapturedTake, folder: Path | None) -> Film:
    """The take's frames, rendered once and kept in `folder`; not kept when that is None."""
    subject = person(take.person)
    poses: Sequence[PersonPose | Bones | None]
    if isinstance(take, CapturedTake):
        moved = captured_take(subject, take.motion, take.fps, longest_s=CAPTURED_S)
        poses, motion_from = moved.poses, moved.motion_from
        room, name = 1000 * take.person, take.motion.stem
    else:
        script = posture_timeline(subject, take.posture, take.number)
        poses = [script.pose_at(k / take.fps) for k in range(int(script.duration_s * take.fps))]
        motion_from = int(np.ceil(script.motion_from_s * take.fps))
        room = 1000 * take.person + 10 * POSTURES.index(take.posture) + take.number
        name = f"{take.posture}-{take.number}"
    width, height = take.size
    path = folder and folder / f"{take.person}-{name}-{width}x{height}-{take.fps:g}-{simulation_digest()}.npz"
    return filmed(subject, poses, motion_from, take.size, room, path)


def filmed(
    subject: Subject,
    poses: Sequence[PersonPose | Bones | None],
    motion_from: int,
    size: Size,
    room: int,
    path: Path | None,
) -> Film:
    """Film of poses of a person, None for the empty scene; rendered once and kept in a file, not kept when that is None."""
    cameras = dict(zip(VIEWERS, paper_cameras(size), strict=True))
    empty = sum(pose is None for pose in poses)
    truths = tuple(None if pose is None else truth_of(subject, pose) for pose in poses)
    return Film(cameras, _images(subject, poses, cameras, room, path), truths, empty, motion_from)


def _images(
    subject: Subject,
    poses: Sequence[PersonPose | Bones | None],
    cameras: Mapping[str, Camera],
    room: int,
    path: Path | None,
) -> dict[str, Bytes]:
    if path is not None and path.is_file():
        with np.load(path) as kept:
            return {viewer: kept[viewer] for viewer in cameras}
    images = {}
    for viewer, camera in cameras.items():
        renderer = camera_of(camera, subject, room)
        images[viewer] = np.stack([renderer.render(pose, k) for k, pose in enumerate(poses)])
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}.npz")  # renamed when complete: another process may read it
        np.savez(part, allow_pickle=False, **images)
        part.replace(path)
    return images


def camera_of(camera: Camera, subject: Subject, room: int) -> SimulatedCamera:
    """Camera that renders a person of either family."""
    if isinstance(subject, Person):
        return SimulatedCamera(camera, subject, room)
    return SimulatedCamera(camera, subject.person, room, subject)


def truth_of(subject: Subject, pose: PersonPose | Bones) -> Truth:
    """Ground truth of a person of either family."""
    return truth(subject, pose) if isinstance(subject, Person) else subject.truth(pose)


@cache
def simulation_digest() -> str:
    """Digest of the source of the simulated people and of captured motion, part of the names of stored frames."""
    folder = Path(next(iter(zenocap.simulation.__path__)))
    sources = (*sorted(folder.rglob("*.py")), Path(captured.__file__), Path(soma.__file__))
    content = b"".join(path.read_bytes() for path in sources)
    return hashlib.sha256(content).hexdigest()[:10]
