"""Colour films of simulated people by the paper's two cameras, with ground truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.harness.case import SHARED
from benchmarks.people.captured import captured_take
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Bytes
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose, Placement, interpolate, neutral, place
from zenocap.simulation.body.skeleton import Bones
from zenocap.simulation.ground_truth import Truth, truth
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import posture_timeline, t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

Size = tuple[int, int]

PEOPLE, TAKES = 12, 2
SMALL = (160, 120)
FPS, CAPTURED_FPS = 15.0, 30.0
CAPTURED_S = 6.0  # of each motion capture file
MOTIONS = ("02_04", "02_07", "02_08", "07_01", "07_05", "10_01")  # jump, sword, broom, walks, kick; not in the clips
EMPTY_FRAMES, T_POSE_S, LOWERING_S = 15, 3.0, 1.0  # of a heading film
VIEWERS = ("1", "2")


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
    fps: float = FPS


def size_of(text: str) -> Size:
    """(width, height) px of WIDTHxHEIGHT."""
    width, height = text.split("x")
    return int(width), int(height)


def motion_file(name: str) -> str:
    """Path in `SHARED` of a motion capture file."""
    return f"motions/cmu_{name}.bvh"


def posture_film(seed: int, posture: str, number: int = 0, size: Size = SMALL) -> Film:
    """One repetition of a posture by one person, with a room of its own."""
    subject = person(seed)
    script = posture_timeline(subject, posture, number)
    poses = [script.pose_at(k / FPS) for k in range(int(script.duration_s * FPS))]
    room = 1000 * seed + 10 * POSTURES.index(posture) + number
    return filmed(subject, poses, int(np.ceil(script.motion_from_s * FPS)), size, room)


def captured_film(seed: int, motion: str, size: Size = SMALL) -> Film:
    """A person with the motion of a shared file, at 30 frames/s."""
    subject = person(seed)
    take = captured_take(subject, SHARED / motion_file(motion), CAPTURED_FPS, longest_s=CAPTURED_S)
    return filmed(subject, take.poses, take.motion_from, size, 1000 * seed, CAPTURED_FPS)


def heading_film(seed: int, heading: int, size: Size = SMALL) -> Film:
    """Empty room, T-pose at a heading in degrees, 0 towards camera 1 and positive towards +X, arms lowered."""
    subject = person(seed)
    held, lowering = round(T_POSE_S * FPS), round(LOWERING_S * FPS)
    shares = [0.0] * held + [k / lowering for k in range(1, lowering + 1)]
    at = Placement(yaw=float(np.radians(heading)))
    poses: list[PersonPose | None] = [None] * EMPTY_FRAMES
    poses += [place(interpolate(t_pose(subject), neutral(subject), share), at) for share in shares]
    return filmed(subject, poses, EMPTY_FRAMES, size, 1000 * seed + heading)


def filmed(
    subject: Person, poses: Sequence[PersonPose | Bones | None], motion_from: int, size: Size, room: int, fps: float = FPS
) -> Film:
    """Film of poses of a person, None for the empty scene.  room: random seed of walls and clothes."""
    cameras = dict(zip(VIEWERS, paper_cameras(size), strict=True))
    images = {}
    for viewer, camera in cameras.items():
        renderer = SimulatedCamera(camera, subject, room)
        images[viewer] = np.stack([renderer.render(pose, k) for k, pose in enumerate(poses)])
    truths = tuple(None if pose is None else truth(subject, pose) for pose in poses)
    return Film(cameras, images, truths, sum(pose is None for pose in poses), motion_from, fps)
