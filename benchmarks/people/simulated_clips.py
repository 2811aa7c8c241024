"""Clips of simulated people, with exact silhouettes or those of a film, in place of the shared clips."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, radians
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from benchmarks.harness.case import SHARED
from benchmarks.people.captured import captured_take, t_pose_opening
from benchmarks.people.films import Film, Size, motion_file
from benchmarks.people.session import rig_of
from benchmarks.people.shared_clips import Instant, silhouettes_of
from tests.support.simulated_cameras import look, paper_cameras
from tests.support.stored import stored
from tests.support.video_file import write_video
from zenocap.common.arrays import Bytes, Floats, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.rig.sources import FirstFrames, VideoFile
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import (
    SIDES,
    Foot,
    Motion,
    PersonPose,
    Placement,
    interpolate,
    minimum_jerk,
    neutral,
    place,
)
from zenocap.simulation.body.skeleton import Bones, pose_bones
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import MotionTimeline, Segment, motion_timeline, session_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZE = (320, 240)
RING, DISTANCE_M, HEIGHT_M = 8, 4.6, 1.6
RINGS = {2: (), 3: (0, 3, 6), 4: (0, 2, 4, 6), 7: (0, 1, 2, 3, 4, 5, 6)}  # cameras of the ring, by number of views
RAGGED = 0.3  # share of the pixels at the edge that are exchanged with the background

FPS, LONGEST_S = 30.0, 6.0  # of motion capture
STANDING = "standing"
ADDED_NOISE, CODING = 1.7, {"crf": "23", "preset": "medium"}  # grey levels, with the film's 2 to 3 about 3; of libx264
CHAIN, CHAINED = "activities", ("bend", "lunge", "reach")
SETTLING_S, STILL_S = 1.0, 4.0
STEP_M, STEPPING_S, HELD_S, AFTERWARDS_S = 0.35, 0.8, 3.0, 4.0  # of a held step
CYCLES = ("walking", "running", "boxing")
CYCLE_FPS = 60.0  # of HumanEva
TRAINING_FRAMES, TEST_FRAMES = 100, {"walking": 433, "running": 393, "boxing": 377}  # [Hybrid Table I]


@dataclass(frozen=True)
class SimulatedClip:
    """Silhouettes and ground truth of one person with one motion.  motion_from: first scored frame."""

    cameras: Mapping[str, Camera]
    instants: tuple[Instant, ...]
    truth: Trajectories
    motion_from: int
    frame_ns: int

    def masks(self, instant: Instant, views: Mapping[str, Camera]) -> dict[str, Mask]:
        """(height, width) of 0 and 1, by viewer."""
        return {view: np.unpackbits(instant.masks[view], axis=1, count=self.cameras[view].size[0]) for view in views}


def cameras_of(views: int, size: Size = SIZE) -> dict[str, Camera]:
    """Two: the paper's; otherwise a ring about the origin."""
    if views == 2:
        return {camera.name: camera for camera in paper_cameras(size)}
    angles = [2 * np.pi * k / RING for k in RINGS[views]]
    middle = np.array([0.0, 1.0, 0.0])
    places = [np.array([DISTANCE_M * np.sin(a), HEIGHT_M, DISTANCE_M * np.cos(a)]) for a in angles]
    return {f"r{k}": look(f"r{k}", place, middle).resized(size) for k, place in zip(RINGS[views], places, strict=True)}


def simulated_clip(
    subject: Person, poses: Sequence[PersonPose | Bones | None], motion_from: int, fps: float, views: int, size: Size = SIZE
) -> SimulatedClip:
    """Clip of consecutive poses; None: an empty scene, at the start only."""
    cameras = cameras_of(views, size)
    masks = {view: _masks(camera, subject, poses) for view, camera in cameras.items()}
    joints = _trajectories([None if pose is None else truth(subject, pose).joints for pose in poses], fps)
    instants = tuple(
        Instant(int(k), round(k * 1e9 / fps), {view: masks[view][k] for view in cameras}) for k in joints.frames
    )
    return SimulatedClip(cameras, instants, joints, motion_from, round(1e9 / fps))


def filmed_clip(film: Film, seed: int) -> SimulatedClip:
    """Clip of the silhouettes that viewers find in videos of a film, coded in its size.  seed: of the noise."""
    rng, rig = np.random.default_rng(seed), rig_of(film.cameras, FirstFrames(film.empty), film.fps, "hybrid")
    with TemporaryDirectory() as folder:
        viewers = []
        for one in rig.viewers:
            noisy = (image + rng.normal(0.0, ADDED_NOISE, image.shape) for image in film.images[one.id])
            images = (np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in noisy)
            path = write_video(Path(folder) / f"{one.id}.mp4", images, fps=round(film.fps), options=CODING)
            viewers.append(replace(one, source=VideoFile(path)))
        instants = tuple(silhouettes_of(replace(rig, viewers=tuple(viewers))))
    joints = _trajectories([None if one is None else one.joints for one in film.truths], film.fps)
    return SimulatedClip(film.cameras, instants, joints, film.motion_from, round(1e9 / film.fps))


def _trajectories(truths: Sequence[Mapping[str, Floats] | None], fps: float) -> Trajectories:
    """Joint centres by frame, None in an empty scene, at the start only."""
    known = [one for one in truths if one is not None]
    frames, names = np.arange(len(truths) - len(known), len(truths), dtype=np.int64), tuple(known[0])
    return Trajectories(names, frames, frames / fps, np.array([[one[name] for name in names] for one in known]), fps)


def cycle_clip(name: str, views: int = 7) -> SimulatedClip:
    """A clip as long as the paper's films: MOTION-PERSON with one of CYCLES and the random seed of a person."""
    motion, _, number = name.partition("-")
    if motion not in CYCLES or not number.isdecimal():
        raise ValueError(f"clip {name}: allowed: a shared clip, or {'|'.join(CYCLES)} and a number, as in walking-3")
    return performed_clip(int(number), motion, views, CYCLE_FPS, (TRAINING_FRAMES + TEST_FRAMES[motion]) / CYCLE_FPS)


def performed_clip(seed: int, motion: str, views: int, fps: float = FPS, longest_s: float = LONGEST_S) -> SimulatedClip:
    """A person with a motion of `motion_timeline`, or with CHAINED one after the other for `CHAIN`."""
    subject = person(seed)
    poses, first = performed_poses(subject, motion, fps, longest_s)
    return simulated_clip(subject, poses, first, fps, views)


def performed_poses(
    subject: Person, motion: str, fps: float = FPS, longest_s: float = LONGEST_S
) -> tuple[list[PersonPose | None], int]:
    """Poses of `performed_clip`, and the first scored frame."""
    seed = subject.seed
    if motion == CHAIN:
        script = session_timeline(subject, [(name, seed) for name in CHAINED], [0.0] * len(CHAINED), seed)
    else:
        script = motion_timeline(subject, motion, seed)
    first = ceil(script.motion_from_s * fps)
    return [script.pose_at(k / fps) for k in range(first + round(longest_s * fps))], first


def captured_clip(seed: int, motion: str, views: int, fps: float = FPS, longest_s: float = LONGEST_S) -> SimulatedClip:
    """A person with the motion of a shared file, or `STANDING` still after the T-pose."""
    subject = person(seed)
    if motion == STANDING:
        return _standing_clip(subject, views)
    take = captured_take(subject, SHARED / motion_file(motion), fps, longest_s=longest_s)
    return simulated_clip(subject, take.poses, take.motion_from, fps, views)


def _standing_clip(subject: Person, views: int) -> SimulatedClip:
    """Empty scene, T-pose, arms down, then standing still; scored a second after the arms are down."""
    opening = t_pose_opening(subject, FPS)
    first = len(opening) + ceil(SETTLING_S * FPS)
    poses = [*opening, *[neutral(subject)] * ceil((SETTLING_S + STILL_S) * FPS)]
    return simulated_clip(subject, poses, first, FPS, views)


def held_clip(seed: int, heading: int, ahead: int, motion: str, views: int, fps: float, size: Size = SIZE) -> SimulatedClip:
    """A step held for 3 s, then up to 4 s of a shared file, or held on with `STANDING`; scored from the step on.

    heading: of both, degrees from +Z towards +X.  ahead: see `held_step`.
    """
    subject, turn, held_s = person(seed), radians(heading), HELD_S + (AFTERWARDS_S if motion == STANDING else 0.0)
    opening = held_step(subject, ahead, held_s, fps)
    poses: Sequence[PersonPose | Bones | None]
    if motion == STANDING:
        poses = [None if pose is None else place(pose, Placement(yaw=turn)) for pose in opening]
    else:
        file = SHARED / motion_file(motion)
        poses = captured_take(subject, file, fps, longest_s=AFTERWARDS_S, opening=opening, heading=turn).poses
    return simulated_clip(subject, poses, len(opening) - ceil(held_s * fps), fps, views, size)


def held_step(subject: Person, ahead: int, held_s: float, fps: float) -> list[PersonPose | None]:
    """Empty scene, T-pose, then a step that is held, towards +Z at the origin.  ahead: the foot in front, RIGHT or LEFT."""
    standing, count = neutral(subject), ceil(STEPPING_S * fps) + ceil(held_s * fps)
    feet = standing.feet.copy()
    feet[:, Foot.Z] = [STEP_M / 2 if side == ahead else -STEP_M / 2 for side in SIDES]
    step = replace(standing, feet=feet)

    def pose_at(time_s: float) -> PersonPose:
        return interpolate(standing, step, minimum_jerk(time_s / STEPPING_S))

    stepping = Segment("step", 0.0, count / fps, Placement(), Motion(count / fps, pose_at))
    swaying = MotionTimeline(subject, subject.seed, (stepping,), 0.0)
    return [*t_pose_opening(subject, fps), *(swaying.pose_at(k / fps) for k in range(count))]


def _masks(camera: Camera, subject: Person, poses: Sequence[PersonPose | Bones | None]) -> Bytes:
    """(frames, rows, bytes) packed silhouettes of one camera, rendered once for the same poses, whatever made them."""
    bones = [None if pose is None else pose_bones(subject, pose) for pose in poses]
    shown = hashlib.sha256(b"".join(b"" if one is None else one.rotation.tobytes() + one.origin.tobytes() for one in bones))

    def rendered() -> Bytes:
        film = SimulatedCamera(camera, subject, subject.seed)
        return np.stack([np.packbits(film.silhouette(pose) != 0, axis=1) for pose in bones])

    return _ragged(stored(rendered, subject.seed, camera, len(bones), shown.hexdigest()), camera.size[0], subject.seed)


def _ragged(packed: Bytes, width: int, seed: int) -> Bytes:
    """Masks (n, rows, bytes) with noise at their edges, as segmentation leaves it."""
    rng, kernel, out = np.random.default_rng(seed), np.ones((3, 3), np.uint8), np.empty_like(packed)
    for k, one in enumerate(packed):
        mask = np.unpackbits(one, axis=1, count=width)
        edge = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, kernel) != 0
        flipped = edge & (rng.random(mask.shape) < RAGGED / 2)
        out[k] = np.packbits(np.where(flipped, 1 - mask, mask), axis=1)
    return out
