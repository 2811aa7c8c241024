"""Faults of a camera or its place: films with one each, and the right advice for each situation."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.cases.rooms.film import CHANGE_S, EMPTY_S, FPS, RoomScene, Situation
from benchmarks.cases.rooms.situations import SITUATIONS, WHITE_BALANCE, scaled
from zenocap.common.arrays import Image
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import AdviceCode

MAINS_HZ = 100.0  # of the light of lamps at 50 Hz
RIPPLE = 0.10  # of that light, amplitude
READOUT_S = 0.02  # of a rolling shutter
DEFOCUS = 0.015  # of the image height, standard deviation of the blur
SENSOR_NOISE = 2.5  # levels, added after the blur of a lens
EXPOSED = 0.7  # share of the frame period
GLOSS = 0.35  # of the light that a glossy floor mirrors
FAR, CUT = 2.0, 0.33  # factor of the focal length; share of the image height by which the camera is turned up
TOWARDS_S = 20.0  # over which the white balance moves

A = AdviceCode
Codes = frozenset[AdviceCode]
LIGHT: Codes = frozenset({A.LIGHT_DRIFT})
COLOUR: Codes = frozenset({A.WHITE_BALANCE})


def _flicker(scene: RoomScene, time_s: float, image: Image) -> Image:
    rows = np.linspace(0.0, READOUT_S, image.shape[0])[:, None, None]
    return scaled(image, 1.0 + RIPPLE * np.cos(2.0 * np.pi * MAINS_HZ * (1.003 * time_s + rows)))


def _soft(scene: RoomScene, time_s: float, image: Image) -> Image:
    blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), DEFOCUS * image.shape[0])
    rng = np.random.default_rng([scene.seed, round(time_s * FPS)])
    return np.asarray(np.clip(blurred + rng.normal(0.0, SENSOR_NOISE, image.shape), 0, 255), dtype=np.uint8)


def _slow_colours(scene: RoomScene, time_s: float, image: Image) -> Image:
    part = np.clip((time_s - EMPTY_S) / TOWARDS_S, 0.0, 1.0)
    return scaled(image, 1.0 + part * (np.array(WHITE_BALANCE) - 1.0))


def _dark(scene: RoomScene, time_s: float, image: Image) -> Image:
    return scaled(image, 0.25)


def _bright(scene: RoomScene, time_s: float, image: Image) -> Image:
    return np.asarray(np.clip(image.astype(np.float32) * 1.8, 0, 255), dtype=np.uint8)


@dataclass(frozen=True)
class FaultFilm:
    """A situation whose advice is known, besides what follows from the true silhouette.

    wanted: codes that have to come.  allowed: those that may come.  since_s: when the fault begins.
    """

    situation: Situation
    wanted: Codes = frozenset()
    allowed: Codes = frozenset()
    since_s: float = EMPTY_S


def _focal(camera: Camera) -> Camera:
    return replace(camera, matrix=camera.matrix * [[1.0 / FAR, 1.0, 1.0], [1.0, 1.0 / FAR, 1.0], [1.0, 1.0, 1.0]])


def _turned_up(camera: Camera) -> Camera:
    matrix = camera.matrix.copy()
    matrix[1, 2] += CUT * camera.size[1]
    return replace(camera, matrix=matrix)


SEVERAL = "all of it"  # situation of several faults at once, of which none can be told alone
RIGHT: Mapping[str, tuple[Codes, Codes, float]] = {
    "light fades by 40 %": (LIGHT, frozenset({A.DARK}), EMPTY_S),
    "lamp switched off": (LIGHT, frozenset(), CHANGE_S),
    "white balance jumps": (COLOUR, LIGHT | {A.SATURATED}, CHANGE_S),
    "white balance jumps while learning": (frozenset(), COLOUR | LIGHT | {A.SATURATED}, EMPTY_S),
    "automatic exposure": (frozenset(), LIGHT, EMPTY_S),
    "glossy floor": (frozenset(), frozenset({A.GLOSSY_FLOOR, A.CONTRAST, A.CUT_OFF}), EMPTY_S),
}
MIRRORS = frozenset({A.GLOSSY_FLOOR}), frozenset({A.CONTRAST, A.CUT_OFF})  # wanted and allowed
FILMS = (
    *(
        FaultFilm(one, *RIGHT.get(one.name, (frozenset(), frozenset(), EMPTY_S)))
        for one in SITUATIONS
        if one.name != SEVERAL
    ),
    FaultFilm(Situation("the demo", demo=True)),
    FaultFilm(Situation("colours drift slowly", tone=_slow_colours), COLOUR, LIGHT),
    FaultFilm(Situation("lamps flicker", tone=_flicker), frozenset({A.FLICKER}), LIGHT),
    FaultFilm(Situation("out of focus", tone=_soft), frozenset({A.FOCUS}), frozenset({A.MOTION_BLUR})),
    FaultFilm(Situation("dark", tone=_dark), frozenset({A.DARK})),
    FaultFilm(Situation("too bright", tone=_bright), frozenset({A.SATURATED}), frozenset({A.FOCUS})),
    FaultFilm(Situation("long exposure", exposed=EXPOSED), frozenset({A.MOTION_BLUR})),
    FaultFilm(Situation("floor that mirrors 35 %", mirrors=GLOSS), *MIRRORS),
    FaultFilm(Situation("the demo, floor that mirrors 35 %", mirrors=GLOSS, demo=True), *MIRRORS),
    FaultFilm(Situation("person far away", view=_focal)),
    FaultFilm(Situation("camera turned up", view=_turned_up)),
)
