"""Films of a simulated person in rooms that change, with the true silhouette of every frame.

Every situation is a film of `LENGTH_S` at `FPS` by one camera of a seed: person, walk, room, noise and camera are those of
the seed and equal in all situations.  A situation changes what its name says, and nothing else.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
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
DOOR_S, RAMP_S = 1.0, 20.0  # a door opens; the light fades
LAMP = 0.6  # of the light that is left, on the side of the room that a lamp does not reach
WHITE_BALANCE = (0.85, 1.0, 1.2)  # blue, green, red
SWAY_M = 0.006  # of quiet standing, amplitude (m); posturography: 5 to 10 mm
NOISE = 6.0  # grey levels, added to those of the camera
JPEG_QUALITY = 35
STAND_S = 60.0  # for which the person stands, in the long film
FRO_S, FRO_PERIOD_S, FRO_SPAN_S = 7.0, 3.0, 0.15  # from when on; period; of the walk, to both sides
CLUTTER = 60  # things in a cluttered room
GLOSS, REFLECTED = 0.3, 0.5  # of a glossy floor: share of the light; of the person's height in the picture
SECOND_PERSON = 900  # seed of the first of the other people

Draw = Callable[["Scene", float], Floats32]
Tone = Callable[["Scene", float, Image], Image]


@dataclass(frozen=True)
class Scene:
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
    dressed: Callable[[Scene], Person] | None = None
    other: Callable[[Scene, float], PersonPose | None] | None = None


@dataclass(frozen=True)
class Shot:
    """A frame of a film.  truth: (height, width) of 0 and 1, without the second person.  pose: of the person, or None."""

    time_s: float
    image: Image
    truth: Mask
    pose: PersonPose | None


def shots(scene: Scene, situation: Situation, truth_every: int = 1, length_s: float = LENGTH_S) -> Iterator[Shot]:
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
        yield Shot(time_s, image, truth, pose)


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


def _light(scene: Scene, time_s: float, image: Image) -> Image:
    share = 1.0 - 0.4 * np.clip((time_s - EMPTY_S / 2) / RAMP_S, 0.0, 1.0)
    return _scaled(image, share)


def _switched(scene: Scene, time_s: float, image: Image) -> Image:
    """A lamp that is switched off: darker by up to 40 % on one side of the picture."""
    if time_s < CHANGE_S:
        return image
    across = np.linspace(1.0, LAMP, image.shape[1])[None, :, None]
    return _scaled(image, across)


def _white_balance(scene: Scene, time_s: float, image: Image) -> Image:
    return image if time_s < CHANGE_S else _scaled(image, np.array(WHITE_BALANCE))


def _early_white_balance(scene: Scene, time_s: float, image: Image) -> Image:
    return image if time_s < EMPTY_S / 2 else _scaled(image, np.array(WHITE_BALANCE))


def _exposure(scene: Scene, time_s: float, image: Image) -> Image:
    """Automatic exposure: the mean of the middle of the image returns to that of the empty room."""
    height, width = image.shape[:2]
    middle = np.s_[height // 4 : 3 * height // 4, width // 4 : 3 * width // 4]
    wanted = float(scene.room[middle].mean())
    return _scaled(image, (wanted / float(image[middle].mean())) ** 2.0)


def _compressed(scene: Scene, time_s: float, image: Image) -> Image:
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)


def _together(scene: Scene, time_s: float, image: Image) -> Image:
    """Light that fades, white balance that jumps, noise of half of NOISE, and compression."""
    faded = _white_balance(scene, time_s, _light(scene, time_s, image))
    rng = np.random.default_rng([scene.seed, round(time_s * FPS)])
    noisy = np.clip(faded + rng.normal(0.0, NOISE / 2.0, image.shape), 0, 255).astype(np.uint8)
    return _compressed(scene, time_s, noisy)


def _noisy(scene: Scene, time_s: float, image: Image) -> Image:
    rng = np.random.default_rng([scene.seed, round(time_s * FPS)])
    return np.clip(image + rng.normal(0.0, NOISE, image.shape), 0, 255).astype(np.uint8)


def _scaled(image: Image, share: float | Floats) -> Image:
    scaled: Image = np.clip(np.rint(image * share), 0, 255).astype(np.uint8)
    return scaled


def _like_the_wall(scene: Scene) -> Person:
    """The person in clothes of the colours of the wall, in its light, trousers a little darker."""
    room = scene.room
    wall = np.median(room[: room.shape[0] // 2].reshape(-1, 3), axis=0)
    blue, green, red = (float(value) for value in wall)
    trousers = (0.85 * blue, 0.85 * green, 0.85 * red)
    worn = replace(scene.walker.person.clothing, shirt_bgr=(blue, green, red), trouser_bgr=trousers, stripes=0.0)
    return replace(scene.walker.person, clothing=worn)


def _with_box(scene: Scene, room: Floats32, x: float, z: float) -> Floats32:
    """The room with a wooden box of 0.5 x 0.5 x 0.9 m on the floor, 2 m or more behind the walk."""
    base = scene.place(x, z)
    corners = np.array(
        [base + np.array([dx, h, dz]) for h in (0.0, 0.9) for dx, dz in ((0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5))]
    )
    pixels = scene.camera.project(corners)
    faces = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    towards = [float(np.linalg.norm(corners[list(face)].mean(axis=0) - scene.camera.centre)) for face in faces]
    for number in np.argsort(towards)[::-1]:
        shade = 0.75 + 0.05 * float(number)
        outline = np.rint(pixels[list(faces[number])]).astype(np.int32)
        cv2.fillConvexPoly(room, outline, (60.0 * shade, 95.0 * shade, 140.0 * shade), cv2.LINE_AA)
    return room


def _furniture(scene: Scene, time_s: float) -> Floats32:
    x = -0.6 if time_s < CHANGE_S else 0.5
    return _with_box(scene, scene.room.copy(), x, 2.3)


def _door(scene: Scene, time_s: float) -> Floats32:
    """A door of 0.9 x 2 m in the wall behind the walk opens to a dark corridor."""
    room = scene.room.copy()
    open_share = float(np.clip((time_s - CHANGE_S) / DOOR_S, 0.0, 1.0))
    if open_share == 0.0:
        return room
    x0, x1 = 0.3, 0.3 + 0.9 * open_share
    corners = np.array(
        [scene.place(x, 3.2) + np.array([0.0, h, 0.0]) for x, h in ((x0, 0.0), (x1, 0.0), (x1, 2.0), (x0, 2.0))]
    )
    cv2.fillConvexPoly(room, np.rint(scene.camera.project(corners)).astype(np.int32), (70.0, 66.0, 60.0), cv2.LINE_AA)
    return room


def _passing(z: float) -> Callable[[Scene, float], PersonPose | None]:
    """A second person who walks across the picture, z m behind the middle of the walk, from 8 s to 16 s."""

    def pose(scene: Scene, time_s: float) -> PersonPose | None:
        share = (time_s - 8.0) / 8.0
        if not 0.0 <= share <= 1.0:
            return None
        return _moved(scene, scene.place(-3.0 + 6.0 * share, z), time_s)

    return pose


def _beside(scene: Scene, time_s: float) -> PersonPose | None:
    """A second person who walks with the first from 8 s to 16 s, half a metre to the right: both touch in the picture."""
    if not 8.0 <= time_s <= 16.0:
        return None
    own = scene.walker.motion.pose_at(time_s - EMPTY_S)
    return _moved(
        scene, np.array([own.pelvis[0], 0.0, own.pelvis[1]]) + scene.place(0.5, 0.0) - scene.place(0.0, 0.0), time_s
    )


def _at_the_back(scene: Scene, time_s: float) -> PersonPose | None:
    """A second person who stands at the back from the start and sways."""
    return _moved(scene, scene.place(1.2, 2.4), 0.4 * np.sin(time_s))


def _moved(scene: Scene, place: Floats, time_s: float) -> PersonPose:
    """A walking pose of the other person at a place."""
    motion = walker(scene.seed + 1, 1, scene.size).motion
    pose = motion.pose_at(2.0 + time_s % (motion.duration_s - 4.0))
    shift = np.array([place[0] - pose.pelvis[0], place[2] - pose.pelvis[1]])
    pelvis, feet = pose.pelvis.copy(), pose.feet.copy()
    pelvis[:2] += shift
    feet[:, :2] += shift
    return replace(pose, pelvis=pelvis, feet=feet)


def _cluttered(scene: Scene, time_s: float) -> Floats32:
    """The room with CLUTTER things of any colour before the walls, as shelves and boxes."""
    room = scene.room.copy()
    height, width = room.shape[:2]
    rng = np.random.default_rng([scene.seed, CLUTTER])
    for _ in range(CLUTTER):
        size = rng.uniform(0.03, 0.15, size=2) * height
        corner = rng.uniform((-0.05 * width, 0.05 * height), (width, 0.65 * height))
        far = corner + size
        colour = rng.uniform(20.0, 230.0, size=3).tolist()
        (x0, y0), (x1, y1) = np.rint(corner).astype(int).tolist(), np.rint(far).astype(int).tolist()
        cv2.rectangle(room, (x0, y0), (x1, y1), colour, -1, cv2.LINE_AA)
    return room


def _plain(scene: Scene) -> Person:
    """The person in plain clothes."""
    worn = replace(scene.walker.person.clothing, stripes=0.0)
    return replace(scene.walker.person, clothing=worn)


SITUATIONS: Sequence[Situation] = (
    Situation("empty room first"),
    Situation("a person from the first frame", empty=False),
    Situation("light fades by 40 %", tone=_light),
    Situation("lamp switched off", tone=_switched),
    Situation("white balance jumps", tone=_white_balance),
    Situation("white balance jumps while learning", tone=_early_white_balance),
    Situation("automatic exposure", tone=_exposure),
    Situation("noise", tone=_noisy),
    Situation("compression", tone=_compressed),
    Situation("clothes like the wall", dressed=_like_the_wall),
    Situation("furniture is moved", room=_furniture),
    Situation("a door opens", room=_door),
    Situation("stands still", still=True),
    Situation("moves in place", fro=True),
    Situation("moves in place, clutter and noise", fro=True, room=_cluttered, dressed=_plain, tone=_noisy),
    Situation("second person passes behind", other=_passing(1.8)),
    Situation("second person at the back", other=_at_the_back),
    Situation("second person touches", other=_beside),
    Situation("second person passes in front", other=_passing(-0.9)),
    Situation("glossy floor", gloss=GLOSS),
    Situation("all of it", empty=False, room=_furniture, tone=_together, other=_passing(1.8), gloss=GLOSS),
    Situation("stands for a minute", still=True, stands_s=STAND_S, length_s=CHANGE_S + STAND_S + 8.0),
)
