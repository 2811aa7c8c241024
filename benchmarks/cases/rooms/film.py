"""Films of a simulated person in a room, with the true silhouette of every frame.

Every film of a seed has the same person, walk, room, noise and camera.  A situation changes what it names and nothing else.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.support.walkers import Walker, walker
from zenocap.common.arrays import Floats, Floats32, Image, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.rendering.camera import SimulatedCamera

FPS = 15
EMPTY_S, LENGTH_S = 5.0, 25.0  # of the empty room, unless the situation is without it; of the film
CHANGE_S = 12.0  # when a sudden change happens
SWAY_M = 0.006  # of quiet standing, amplitude (m); posturography: 5 to 10 mm
FRO_S, FRO_PERIOD_S, FRO_SPAN_S = 7.0, 3.0, 0.15  # from when on; period; of the walk, to both sides
REFLECTED = 0.5  # of the person's height in the picture, in a glossy floor
SECOND_PERSON = 900  # seed of the first of the other people

Draw = Callable[["RoomScene", float], Floats32]
Tone = Callable[["RoomScene", float, Image], Image]


@dataclass(frozen=True)
class RoomScene:
    """The person, the walk and one camera of a seed.  size: (width, height) px.  views: cameras around the walk."""

    seed: int
    size: tuple[int, int]
    views: int = 2
    view: str = "cam01"

    @cached_property
    def walker(self) -> Walker:
        return walker(self.seed, self.views, self.size)

    @cached_property
    def room(self) -> Floats32:
        """The empty room, (height, width, 3) grey levels."""
        return SimulatedCamera(self.camera, self.walker.person, self.seed).empty()

    @property
    def camera(self) -> Camera:
        return self.walker.cameras[self.view]

    def place(self, x: float, z: float) -> Floats:
        """World coordinates of a point on the floor, x m to the right of the middle of the walk and z m behind it, as the
        first camera sees it."""
        centre = self.walker.cameras["cam01"].centre
        middle = np.array([0.0, 0.0, 0.0])
        away = middle - centre
        away[1] = 0.0
        away /= np.linalg.norm(away)
        right = np.array([-away[2], 0.0, away[0]])
        return np.asarray(middle + x * right + z * away)


@dataclass(frozen=True)
class Situation:
    """What is different.  empty: the film begins with the empty room.

    room: the empty room at a time (s), of grey levels; None: as it is.  tone: applied to the finished image.
    still: the person stands from CHANGE_S on.  fro: steps to and fro from FRO_S on.  dressed: the person in other clothes.
    other: pose of a second person at a time, None when there is none.  gloss: reflectance of the floor.
    stands_s: for how long the person stands, until the end unless given.  length_s: of the film.
    """

    name: str
    empty: bool = True
    room: Draw | None = None
    tone: Tone | None = None
    still: bool = False
    fro: bool = False
    stands_s: float = LENGTH_S
    length_s: float = LENGTH_S
    gloss: float = 0.0
    dressed: Callable[[RoomScene], Person] | None = None
    other: Callable[[RoomScene, float], PersonPose | None] | None = None


@dataclass(frozen=True)
class RoomFrame:
    """A frame of a film.  truth: (height, width) of 0 and 1, without the second person.  pose: of the person, or None."""

    time_s: float
    image: Image
    truth: Mask
    pose: PersonPose | None


def shots(scene: RoomScene, situation: Situation, truth_every: int = 1, length_s: float = LENGTH_S) -> Iterator[RoomFrame]:
    """The film of a situation.  truth_every: frames between two with a truth; it is empty in the others."""
    subject = scene.walker.person if situation.dressed is None else situation.dressed(scene)
    film = SimulatedCamera(scene.camera, subject, scene.seed)
    second = SimulatedCamera(scene.camera, person(SECOND_PERSON + scene.seed), scene.seed)
    motion = scene.walker.motion
    first_s = EMPTY_S if situation.empty else 0.0
    for k in range(int(max(length_s, situation.length_s) * FPS)):
        time_s = k / FPS
        stood_s = min(max(time_s - CHANGE_S, 0.0), situation.stands_s) if situation.still else 0.0
        moving_s = time_s - stood_s
        if situation.fro and time_s > FRO_S:
            moving_s = FRO_S + FRO_SPAN_S * float(np.sin(2.0 * np.pi * (time_s - FRO_S) / FRO_PERIOD_S))
        pose = None if time_s < first_s else motion.pose_at((moving_s - first_s) % motion.duration_s)
        if pose is not None and 0.0 < stood_s < situation.stands_s:
            pose = _swaying(pose, time_s - CHANGE_S)
        other = None if situation.other is None else situation.other(scene, time_s)
        room = None if situation.room is None else situation.room(scene, time_s)
        image = film.render(pose, k, room, [] if other is None else [(second, other)])
        truth = np.asarray(film.silhouette(pose) != 0, dtype=np.uint8)
        if situation.gloss:
            image = _reflected(image, truth, situation.gloss)
        if situation.tone is not None:
            image = situation.tone(scene, time_s, image)
        truth = truth if k % truth_every == 0 else np.zeros_like(truth)
        if other is not None and pose is not None and truth.any():
            truth = _before(film, pose, second, other, truth)
        yield RoomFrame(time_s, image, truth, pose)


def _reflected(image: Image, truth: Mask, share: float) -> Image:
    """The picture with the person's lower part mirrored in the floor under the feet."""
    rows = np.flatnonzero(truth.any(axis=1))
    if len(rows) == 0:
        return image
    foot, height = int(rows[-1]), int(rows[-1] - rows[0])
    count = min(int(REFLECTED * height), image.shape[0] - foot - 1)
    out = image.copy()
    if count > 0:
        mirrored, own = image[foot - count : foot][::-1], truth[foot - count : foot][::-1]
        faded = share * np.linspace(1.0, 0.0, count)[:, None, None] * own[..., None]
        below = out[foot + 1 : foot + 1 + count]
        below[:] = np.rint((1.0 - faded) * below + faded * mirrored).astype(np.uint8)
    return out


def _swaying(pose: PersonPose, time_s: float) -> PersonPose:
    """A standing person: the pelvis sways by SWAY_M, more slowly to the front than to the side."""
    pelvis = pose.pelvis.copy()
    pelvis[0] += SWAY_M * np.sin(2.0 * np.pi * 0.31 * time_s)
    pelvis[1] += SWAY_M * np.sin(2.0 * np.pi * 0.23 * time_s)
    return replace(pose, pelvis=pelvis)


def _before(film: SimulatedCamera, pose: PersonPose, second: SimulatedCamera, other: PersonPose, truth: Mask) -> Mask:
    """The true silhouette without what a second person in front of the first hides."""
    if film.distance(pose) <= second.distance(other):
        return truth
    return np.where(second.silhouette(other) != 0, 0, truth).astype(np.uint8)
