"""Takes of simulated people in colour by the paper's two cameras, with ground truth."""

import hashlib
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import zenocap.simulation
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Bytes
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import Truth, truth
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import EMPTY, posture_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

Size = tuple[int, int]

PEOPLE, TAKES = 12, 2
SMALL, LARGE = (160, 120), (640, 480)
FPS = 15.0
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


def film(take: Take, folder: Path | None) -> Film:
    """The take's frames, rendered once and kept in `folder`; not kept when that is None."""
    subject = person(take.person)
    script = posture_timeline(subject, take.posture, take.number)
    count = int(script.duration_s * take.fps)
    poses = [script.pose_at(k / take.fps) for k in range(count)]
    cameras = dict(zip(VIEWERS, paper_cameras(take.size), strict=True))
    return Film(
        cameras,
        _images(take, cameras, count, folder),
        tuple(None if pose is None else truth(subject, pose) for pose in poses),
        sum(script.segment_at(k / take.fps).name == EMPTY for k in range(count)),
        int(np.ceil(script.motion_from_s * take.fps)),
    )


def _images(take: Take, cameras: Mapping[str, Camera], count: int, folder: Path | None) -> dict[str, Bytes]:
    path = None if folder is None else folder / f"{_name(take)}.npz"
    if path is not None and path.is_file():
        with np.load(path) as kept:
            return {viewer: kept[viewer] for viewer in cameras}
    subject = person(take.person)
    script = posture_timeline(subject, take.posture, take.number)
    images = {}
    for viewer, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, 1000 * take.person + 10 * POSTURES.index(take.posture) + take.number)
        images[viewer] = np.stack([renderer.render(script.pose_at(k / take.fps), k) for k in range(count)])
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}.npz")  # renamed when complete: another process may read it
        np.savez(part, allow_pickle=False, **images)
        part.replace(path)
    return images


def _name(take: Take) -> str:
    width, height = take.size
    return f"{take.person}-{take.posture}-{take.number}-{width}x{height}-{take.fps:g}-{_actor_digest()}"


@cache
def _actor_digest() -> str:
    """Digest of the source of the simulated person, which names the stored frames."""
    folder = Path(next(iter(zenocap.simulation.__path__)))
    content = b"".join(path.read_bytes() for path in sorted(folder.rglob("*.py")))
    return hashlib.sha256(content).hexdigest()[:10]
