"""The synthetic actor seen by a ring of small cameras, for tests of the tracker."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from actor_cameras import look
from numpy.typing import NDArray

from common.actor.person import Person, person
from common.actor.pose import ActorPose, Placement, place
from common.actor.render import ActorCamera
from common.actor.script import stretched
from common.body.anatomy import FOURTEEN_PARTS
from common.camera.pinhole import Camera
from services.tracker.closest import Singles, rays_of
from services.tracker.hull import outlines, scene_of
from services.tracker.phases import Options, Setup
from services.tracker.room import Room, room_of

Mask = NDArray[np.uint8]
SIZE = (240, 180)
FRAME_NS = 1_000_000_000 // 30
MIDDLE = np.array([0.0, 1.0, 0.0])


@lru_cache
def ring(count: int, size: tuple[int, int] = SIZE) -> dict[str, Camera]:
    """Cameras "1", "2" ... all around, 1.2 to 2 m high and 5 m away; two of them stand at a right angle."""
    turns = [0.0, -np.pi / 2] if count == 2 else 2 * np.pi * np.arange(count) / count
    heights = 1.2 + 0.8 * (np.arange(count) % 2)
    return {
        str(k): look(f"cam{k}", np.array([5.0 * np.sin(turn), height, 5.0 * np.cos(turn)]), MIDDLE).resized(size)
        for k, (turn, height) in enumerate(zip(turns, heights, strict=True), start=1)
    }


def setup(cameras: Mapping[str, Camera], person_height: float | None = None, seed: int = 0) -> Setup:
    options = Options(particles=6, points=300, seed=seed)
    return Setup(FOURTEEN_PARTS, cameras, FRAME_NS, None, options, person_height)


@lru_cache
def someone(seed: int) -> Person:
    return person(seed)


def initial(seed: int, x: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> ActorPose:
    """Somebody in the initial posture, metres and radians."""
    return place(stretched(someone(seed)), Placement(x, z, yaw))


def seen(cameras: Mapping[str, Camera], seed: int, pose: ActorPose | None) -> dict[str, Mask]:
    """Masks by viewer, (height, width); empty ones of nobody."""
    if pose is None:
        return {viewer: np.zeros(camera.size[::-1], np.uint8) for viewer, camera in cameras.items()}
    return {viewer: _filming(camera, seed).silhouette(pose) for viewer, camera in cameras.items()}


def scene(cameras: Mapping[str, Camera], masks: Sequence[Mask | None], points: int = 300) -> tuple[Singles, Room]:
    """Rays and room."""
    contours, silhouettes = outlines(masks, list(cameras.values()), points)
    return rays_of(scene_of(contours, silhouettes)), room_of(silhouettes)


_FILMING: dict[tuple[int, int], ActorCamera] = {}


def _filming(camera: Camera, seed: int) -> ActorCamera:
    key = (id(camera), seed)
    if key not in _FILMING:
        _FILMING[key] = ActorCamera(camera, someone(seed), 0)
    return _FILMING[key]
