"""Faults of a camera or its place: films with one each, and the advice that is right for the situations of the rooms."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.rooms.situations import (
    EMPTY_S,
    FPS,
    SITUATIONS,
    WHITE_BALANCE,
    Scene,
    Shot,
    Situation,
    Tone,
    shots,
)
from zenocap.common.arrays import Image
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import AdviceCode
from zenocap.simulation.rendering.camera import SimulatedCamera

MAINS_HZ = 100.0  # of the light of lamps at 50 Hz
RIPPLE = 0.10  # of that light, amplitude
READOUT_S = 0.02  # of a rolling shutter
DEFOCUS = 0.015  # of the image height, standard deviation of the blur
SENSOR_NOISE = 2.5  # levels, added after the blur of a lens
EXPOSED, EXPOSURES = 0.7, 6  # share of the frame period, and the images that are averaged over it
GLOSS = 0.35  # of the light that a glossy floor mirrors
FAR, CUT = 2.0, 0.33  # factor of the focal length; share of the image height by which the camera is turned up
TOWARDS_S = 20.0  # over which the white balance moves

FILM_S = 20.0  # length of the films
TRUTH_EVERY = 15  # frames between two true silhouettes

A = AdviceCode
Codes = frozenset[AdviceCode]
LIGHT: Codes = frozenset({A.LIGHT_DRIFT})
COLOUR: Codes = frozenset({A.WHITE_BALANCE})


def _flicker(scene: Scene, time_s: float, image: Image) -> Image:
    rows = np.linspace(0.0, READOUT_S, image.shape[0])[:, None, None]
    share = 1.0 + RIPPLE * np.cos(2.0 * np.pi * MAINS_HZ * (1.003 * time_s + rows))
    return np.asarray(np.clip(np.rint(image * share), 0, 255), dtype=np.uint8)


def _soft(scene: Scene, time_s: float, image: Image) -> Image:
    blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), DEFOCUS * image.shape[0])
    rng = np.random.default_rng([scene.seed, round(time_s * FPS)])
    return np.asarray(np.clip(blurred + rng.normal(0.0, SENSOR_NOISE, image.shape), 0, 255), dtype=np.uint8)


def _slow_colours(scene: Scene, time_s: float, image: Image) -> Image:
    part = np.clip((time_s - EMPTY_S) / TOWARDS_S, 0.0, 1.0)
    share = 1.0 + part * (np.array(WHITE_BALANCE) - 1.0)
    return np.asarray(np.clip(np.rint(image * share), 0, 255), dtype=np.uint8)


def _dark(scene: Scene, time_s: float, image: Image) -> Image:
    return np.asarray(np.clip(np.rint(image * 0.25), 0, 255), dtype=np.uint8)


def _bright(scene: Scene, time_s: float, image: Image) -> Image:
    return np.asarray(np.clip(image.astype(np.float32) * 1.8, 0, 255), dtype=np.uint8)


@dataclass(frozen=True)
class Film:
    """A situation whose advice is known.  wanted: one of these codes has to come.  allowed: those that may come too.

    exposed: share of the frame period.  gloss: see `SimulatedCamera.render`.  view: changes the camera of the scene.
    """

    situation: Situation
    wanted: Codes = frozenset()
    allowed: Codes = frozenset()
    exposed: float = 0.0
    gloss: float = 0.0
    view: Callable[[Camera], Camera] | None = None

    @property
    def name(self) -> str:
        return self.situation.name

    def camera(self, scene: Scene) -> Camera:
        return scene.camera if self.view is None else self.view(scene.camera)

    def shots(self, scene: Scene) -> Iterator[Shot]:
        """The film in the room of a scene."""
        if not self.exposed and not self.gloss and self.view is None:
            yield from shots(scene, self.situation, TRUTH_EVERY, FILM_S)
            return
        film = SimulatedCamera(self.camera(scene), scene.walker.person, scene.seed)
        motion = scene.walker.motion
        for k in range(int(FILM_S * FPS)):
            time_s = k / FPS
            pose = None if time_s < EMPTY_S else motion.pose_at((time_s - EMPTY_S) % motion.duration_s)
            if not self.exposed or pose is None:
                image = film.render(pose, k, gloss=self.gloss)
            else:
                times = time_s - EMPTY_S + np.linspace(0.0, self.exposed / FPS, EXPOSURES)
                every = [film.render(motion.pose_at(at % motion.duration_s), k) for at in times.tolist()]
                image = np.rint(np.mean(every, axis=0)).astype(np.uint8)
            truth = np.asarray(film.silhouette(pose if k % TRUTH_EVERY == 0 else None) != 0, dtype=np.uint8)
            yield Shot(time_s, image, truth, pose)


def _focal(camera: Camera) -> Camera:
    matrix = camera.matrix.copy()
    matrix[[0, 1], [0, 1]] /= FAR
    return replace(camera, matrix=matrix)


def _turned_up(camera: Camera) -> Camera:
    matrix = camera.matrix.copy()
    matrix[1, 2] += CUT * camera.size[1]
    return replace(camera, matrix=matrix)


def _toned(name: str, tone: Tone) -> Situation:
    return Situation(name, tone=tone)


RIGHT: Mapping[str, tuple[Codes, Codes]] = {
    "light fades by 40 %": (LIGHT, frozenset({A.DARK})),
    "lamp switched off": (LIGHT, frozenset({A.CONTRAST, A.HOLES})),
    "white balance jumps": (COLOUR, LIGHT | {A.SATURATED}),
    "white balance jumps while learning": (frozenset(), COLOUR | LIGHT | {A.SATURATED}),
    "automatic exposure": (frozenset(), LIGHT),
    "noise": (frozenset(), frozenset({A.CONTRAST})),
    "compression": (frozenset(), frozenset({A.CONTRAST, A.HOLES})),
    "clothes like the wall": (frozenset({A.CONTRAST, A.HOLES}), frozenset()),
}
FILMS = (
    *(Film(one, *RIGHT.get(one.name, (frozenset(), frozenset()))) for one in SITUATIONS),
    Film(_toned("colours drift slowly", _slow_colours), COLOUR, LIGHT),
    Film(_toned("lamps flicker", _flicker), frozenset({A.FLICKER}), LIGHT),
    Film(_toned("out of focus", _soft), frozenset({A.FOCUS}), frozenset({A.CONTRAST, A.MOTION_BLUR})),
    Film(_toned("dark", _dark), frozenset({A.DARK}), frozenset({A.CONTRAST, A.HOLES})),
    Film(_toned("too bright", _bright), frozenset({A.SATURATED}), frozenset({A.CONTRAST, A.HOLES, A.FOCUS})),
    Film(Situation("long exposure"), frozenset({A.MOTION_BLUR}), exposed=EXPOSED),
    Film(
        Situation("floor that mirrors 35 %"),
        frozenset({A.GLOSSY_FLOOR}),
        frozenset({A.CONTRAST, A.CUT_OFF, A.HOLES}),
        gloss=GLOSS,
    ),
    Film(Situation("person far away"), frozenset({A.SMALL}), view=_focal),
    Film(Situation("camera turned up"), frozenset({A.CUT_OFF}), view=_turned_up),
)
