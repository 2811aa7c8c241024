"""Films of a simulated person in a room, with the true silhouette of every frame.

Every film of a seed has the same person, walk, room, noise and camera.  A situation changes what it names and nothing else.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.support.walkers import Walker, walker
from zenocap.common.arrays import Bools, Floats, Floats32, Image, Mask
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.common.rig.rig import demo_rig_file
from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

FPS = 15
EMPTY_S, LENGTH_S = 5.0, 25.0  # of the empty room, unless the situation is without it; of the film
CHANGE_S = 12.0  # when a sudden change happens
SWAY_M = 0.006  # of quiet standing, amplitude (m); posturography: 5 to 10 mm
FRO_S, FRO_PERIOD_S, FRO_SPAN_S = 7.0, 3.0, 0.15  # from when on; period; of the walk, to both sides
REFLECTED = 0.5  # of the person's height in the picture, in a glossy floor
SECOND_PERSON = 900  # seed of the first of the other people
EXPOSURES = 4  # images that are averaged over an exposure
DEMO_FROM_S = 5.0  # of the time line of the demo, when the person is in the T-pose for a second longer

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
        away = self.walker.cameras["cam01"].centre * [-1.0, 0.0, -1.0]
        away /= np.linalg.norm(away)
        return np.asarray(x * np.array([-away[2], 0.0, away[0]]) + z * away)


@dataclass(frozen=True)
class Situation:
    """What is different.  empty: the film begins with the empty room.

    room: the empty room at a time (s), of grey levels; None: as it is.  tone: applied to the finished image.
    still: the person stands from CHANGE_S on.  fro: steps to and fro from FRO_S on.  dressed: the person in other clothes.
    other: pose of a second person at a time, None when there is none.  gloss: reflectance of the floor.
    stands_s: for how long the person stands, until the end unless given.  least_s: length of the film, unless it is longer.
    exposed: share of the frame period.  view: changes the camera of the scene.  mirrors: see `gloss` of the camera.
    demo: the motion and the first camera of `zenocap demo` instead of the walk.
    """

    name: str
    empty: bool = True
    room: Draw | None = None
    tone: Tone | None = None
    still: bool = False
    fro: bool = False
    stands_s: float = LENGTH_S
    least_s: float = 0.0
    gloss: float = 0.0
    dressed: Callable[[RoomScene], Person] | None = None
    other: Callable[[RoomScene, float], PersonPose | None] | None = None
    exposed: float = 0.0
    view: Callable[[Camera], Camera] | None = None
    mirrors: float = 0.0
    demo: bool = False

    @property
    def first_s(self) -> float:
        """Time of the first frame with the person, seconds."""
        return EMPTY_S if self.empty else 0.0

    def camera(self, scene: RoomScene) -> Camera:
        if self.demo:
            return read_calibration(demo_rig_file().parent / "demo-calibration.toml")["cam01"].resized(scene.size)
        return scene.camera if self.view is None else self.view(scene.camera)

    def motion(self, scene: RoomScene) -> Callable[[float], PersonPose | None]:
        """Pose of the person by the time in the film (s)."""
        motion, first_s = scene.walker.motion, self.first_s
        script = demo_timeline(scene.walker.person, scene.seed) if self.demo else None

        def pose_at(time_s: float) -> PersonPose | None:
            if time_s < first_s:
                return None
            if script is not None:
                return script.pose_at(time_s - first_s + DEMO_FROM_S)
            stood_s = min(max(time_s - CHANGE_S, 0.0), self.stands_s) if self.still else 0.0
            moving_s = time_s - stood_s
            if self.fro and time_s > FRO_S:
                moving_s = FRO_S + FRO_SPAN_S * float(np.sin(2.0 * np.pi * (time_s - FRO_S) / FRO_PERIOD_S))
            pose = motion.pose_at((moving_s - first_s) % motion.duration_s)
            return _swaying(pose, time_s - CHANGE_S) if 0.0 < stood_s < self.stands_s else pose

        return pose_at


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
    camera, pose_at = situation.camera(scene), situation.motion(scene)
    film = SimulatedCamera(camera, subject, scene.seed)
    second = SimulatedCamera(camera, person(SECOND_PERSON + scene.seed), scene.seed)
    for k in range(int(max(length_s, situation.least_s) * FPS)):
        time_s = k / FPS
        pose = pose_at(time_s)
        other = None if situation.other is None else situation.other(scene, time_s)
        room = None if situation.room is None else situation.room(scene, time_s)
        beside = [] if other is None else [(second, other)]
        every = [pose]
        if situation.exposed and pose is not None:
            every = [pose_at(time_s + at) for at in np.linspace(0.0, situation.exposed / FPS, EXPOSURES).tolist()]
        images = [film.render(one, k, room, beside, situation.mirrors) for one in every]
        image = np.rint(np.mean(images, axis=0)).astype(np.uint8)
        if situation.gloss:
            image = _reflected(image, film.silhouette(pose) != 0, situation.gloss)
        if situation.tone is not None:
            image = situation.tone(scene, time_s, image)
        truth = np.asarray(film.silhouette(pose if k % truth_every == 0 else None) != 0, dtype=np.uint8)
        if other is not None and pose is not None and truth.any():
            truth = _before(film, pose, second, other, truth)
        yield RoomFrame(time_s, image, truth, pose)


def _reflected(image: Image, silhouette: Bools, share: float) -> Image:
    """The picture with the person's lower part mirrored in the floor under the feet."""
    rows = np.flatnonzero(silhouette.any(axis=1))
    if len(rows) == 0:
        return image
    foot, height = int(rows[-1]), int(rows[-1] - rows[0])
    count = min(int(REFLECTED * height), image.shape[0] - foot - 1)
    out = image.copy()
    if count > 0:
        mirrored, own = image[foot - count : foot][::-1], silhouette[foot - count : foot][::-1]
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
