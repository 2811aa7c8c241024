"""Situations in rooms: what changes in the light, in the room, in the clothes, and by other people."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np

from benchmarks.cases.rooms.film import CHANGE_S, EMPTY_S, FPS, RoomScene, Situation, Tone
from tests.support.walkers import walker
from zenocap.common.arrays import Floats, Floats32, Image
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import PersonPose

DOOR_S, RAMP_S = 1.0, 20.0  # a door opens; the light fades
LAMP = 0.6  # of the light that is left, on the side of the room that a lamp does not reach
WHITE_BALANCE = (0.85, 1.0, 1.2)  # blue, green, red
NOISE = 6.0  # grey levels, added to those of the camera
JPEG_QUALITY = 35
STAND_S = 60.0  # for which the person stands, in the long film
CLUTTER = 60  # things in a cluttered room
GLOSS = 0.3  # of the light, that a glossy floor mirrors


def _light(scene: RoomScene, time_s: float, image: Image) -> Image:
    share = 1.0 - 0.4 * np.clip((time_s - EMPTY_S / 2) / RAMP_S, 0.0, 1.0)
    return scaled(image, share)


def _switched(scene: RoomScene, time_s: float, image: Image) -> Image:
    """A lamp that is switched off: darker by up to 40 % on one side of the picture."""
    if time_s < CHANGE_S:
        return image
    across = np.linspace(1.0, LAMP, image.shape[1])[None, :, None]
    return scaled(image, across)


def _white_balance(since_s: float) -> Tone:
    return lambda scene, time_s, image: image if time_s < since_s else scaled(image, np.array(WHITE_BALANCE))


def _exposure(scene: RoomScene, time_s: float, image: Image) -> Image:
    """Automatic exposure: the mean of the middle of the image returns to that of the empty room."""
    height, width = image.shape[:2]
    middle = np.s_[height // 4 : 3 * height // 4, width // 4 : 3 * width // 4]
    wanted = float(scene.room[middle].mean())
    return scaled(image, (wanted / float(image[middle].mean())) ** 2.0)


def _compressed(scene: RoomScene, time_s: float, image: Image) -> Image:
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)


def _together(scene: RoomScene, time_s: float, image: Image) -> Image:
    """Light that fades, white balance that jumps, noise of half of NOISE, and compression."""
    faded = _white_balance(CHANGE_S)(scene, time_s, _light(scene, time_s, image))
    return _compressed(scene, time_s, _noisy(scene, time_s, faded, NOISE / 2.0))


def _noisy(scene: RoomScene, time_s: float, image: Image, levels: float = NOISE) -> Image:
    rng = np.random.default_rng([scene.seed, round(time_s * FPS)])
    return np.clip(image + rng.normal(0.0, levels, image.shape), 0, 255).astype(np.uint8)


def scaled(image: Image, share: float | Floats) -> Image:
    scaled: Image = np.clip(np.rint(image * share), 0, 255).astype(np.uint8)
    return scaled


def _like_the_wall(scene: RoomScene) -> Person:
    """The person in clothes of the colours of the wall, in its light, trousers a little darker."""
    room = scene.room
    wall = np.median(room[: room.shape[0] // 2].reshape(-1, 3), axis=0)
    blue, green, red = (float(value) for value in wall)
    trousers = (0.85 * blue, 0.85 * green, 0.85 * red)
    worn = replace(scene.walker.person.clothing, shirt_bgr=(blue, green, red), trouser_bgr=trousers, stripes=0.0)
    return replace(scene.walker.person, clothing=worn)


def _with_box(scene: RoomScene, x: float, z: float) -> Floats32:
    """The room with a wooden box of 0.5 x 0.5 x 0.9 m on the floor, 2 m or more behind the walk."""
    room = scene.room.copy()
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


def _furniture(scene: RoomScene, time_s: float) -> Floats32:
    x = -0.6 if time_s < CHANGE_S else 0.5
    return _with_box(scene, x, 2.3)


def _door(scene: RoomScene, time_s: float) -> Floats32:
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


def _passing(z: float) -> Callable[[RoomScene, float], PersonPose | None]:
    """A second person who walks across the picture, z m behind the middle of the walk, from 8 s to 16 s."""

    def pose(scene: RoomScene, time_s: float) -> PersonPose | None:
        share = (time_s - 8.0) / 8.0
        if not 0.0 <= share <= 1.0:
            return None
        return _moved(scene, scene.place(-3.0 + 6.0 * share, z), time_s)

    return pose


def _beside(scene: RoomScene, time_s: float) -> PersonPose | None:
    """A second person who walks with the first from 8 s to 16 s, half a metre to the right: both touch in the picture."""
    if not 8.0 <= time_s <= 16.0:
        return None
    own = scene.walker.motion.pose_at(time_s - EMPTY_S)
    return _moved(
        scene, np.array([own.pelvis[0], 0.0, own.pelvis[1]]) + scene.place(0.5, 0.0) - scene.place(0.0, 0.0), time_s
    )


def _at_the_back(scene: RoomScene, time_s: float) -> PersonPose | None:
    """A second person who stands at the back from the start and sways."""
    return _moved(scene, scene.place(1.2, 2.4), 0.4 * np.sin(time_s))


def _moved(scene: RoomScene, place: Floats, time_s: float) -> PersonPose:
    """A walking pose of the other person at a place."""
    motion = walker(scene.seed + 1, 1, scene.size).motion
    pose = motion.pose_at(2.0 + time_s % (motion.duration_s - 4.0))
    shift = np.array([place[0] - pose.pelvis[0], place[2] - pose.pelvis[1]])
    pelvis, feet = pose.pelvis.copy(), pose.feet.copy()
    pelvis[:2] += shift
    feet[:, :2] += shift
    return replace(pose, pelvis=pelvis, feet=feet)


def _cluttered(scene: RoomScene, time_s: float) -> Floats32:
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


def _plain(scene: RoomScene) -> Person:
    """The person in plain clothes."""
    worn = replace(scene.walker.person.clothing, stripes=0.0)
    return replace(scene.walker.person, clothing=worn)


SITUATIONS: Sequence[Situation] = (
    Situation("empty room first"),
    Situation("a person from the first frame", empty=False),
    Situation("light fades by 40 %", tone=_light),
    Situation("lamp switched off", tone=_switched),
    Situation("white balance jumps", tone=_white_balance(CHANGE_S)),
    Situation("white balance jumps while learning", tone=_white_balance(EMPTY_S / 2)),
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
    Situation("stands for a minute", still=True, stands_s=STAND_S, least_s=CHANGE_S + STAND_S + 8.0),
)
