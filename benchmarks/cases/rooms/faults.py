"""Faults of a camera or its place: films with one each, and the right advice for each situation."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice

import cv2
import numpy as np

from benchmarks.cases.rooms.film import CHANGE_S, EMPTY_S, FPS, LENGTH_S, RoomFrame, RoomScene, Situation, shots
from benchmarks.cases.rooms.situations import SITUATIONS, WHITE_BALANCE, scaled
from zenocap.common.arrays import Image
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import AdviceCode
from zenocap.common.rig.rig import demo_rig_file
from zenocap.simulation.body.pose import PersonPose
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

MAINS_HZ = 100.0  # of the light of lamps at 50 Hz
RIPPLE = 0.10  # of that light, amplitude
READOUT_S = 0.02  # of a rolling shutter
DEFOCUS = 0.015  # of the image height, standard deviation of the blur
SENSOR_NOISE = 2.5  # levels, added after the blur of a lens
EXPOSED, EXPOSURES = 0.7, 4  # share of the frame period, and the images that are averaged over it
GLOSS = 0.35  # of the light that a glossy floor mirrors
FAR, CUT = 2.0, 0.33  # factor of the focal length; share of the image height by which the camera is turned up
DEMO_FROM_S = 5.0  # of the time line of the demo, when the person is in the T-pose for a second longer
TOWARDS_S = 20.0  # over which the white balance moves

FILM_S = 18.0  # length of the films
TRUTH_EVERY = 5  # frames between two true silhouettes

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
    exposed: share of the frame period.  gloss: see `SimulatedCamera.render`.  view: changes the camera of the scene.
    demo: the motion and the first camera of `zenocap demo` instead of the walk.
    """

    situation: Situation
    wanted: Codes = frozenset()
    allowed: Codes = frozenset()
    since_s: float = EMPTY_S
    exposed: float = 0.0
    gloss: float = 0.0
    view: Callable[[Camera], Camera] | None = None
    demo: bool = False

    @property
    def name(self) -> str:
        return self.situation.name

    def without_tone(self) -> "FaultFilm":
        """The film that is rendered; equal for films that differ in their tone."""
        plain = replace(self.situation, name="", tone=None)
        return replace(self, situation=plain, wanted=frozenset(), allowed=frozenset(), since_s=0.0)

    def toned(self, scene: RoomScene, shot: RoomFrame) -> RoomFrame:
        """A shot of `without_tone` as it is in this film."""
        tone = self.situation.tone
        return shot if tone is None else replace(shot, image=tone(scene, shot.time_s, shot.image))

    def camera(self, scene: RoomScene) -> Camera:
        if self.demo:
            return read_calibration(demo_rig_file().parent / "demo-calibration.toml")["cam01"].resized(scene.size)
        return scene.camera if self.view is None else self.view(scene.camera)

    def shots(self, scene: RoomScene) -> Iterator[RoomFrame]:
        """The film in the room of a scene."""
        if not self.exposed and not self.gloss and not self.demo and self.view is None:
            length_s = FILM_S if self.situation.length_s == LENGTH_S else self.situation.length_s
            yield from islice(shots(scene, self.situation, TRUTH_EVERY, length_s), int(length_s * FPS))
            return
        film = SimulatedCamera(self.camera(scene), scene.walker.person, scene.seed)
        pose_at = self._motion(scene)
        for k in range(int(FILM_S * FPS)):
            time_s = k / FPS
            pose = pose_at(time_s)
            if not self.exposed or pose is None:
                image = film.render(pose, k, gloss=self.gloss)
            else:
                times = time_s + np.linspace(0.0, self.exposed / FPS, EXPOSURES)
                every = [film.render(pose_at(at), k) for at in times.tolist()]
                image = np.rint(np.mean(every, axis=0)).astype(np.uint8)
            truth = np.asarray(film.silhouette(pose if k % TRUTH_EVERY == 0 else None) != 0, dtype=np.uint8)
            yield RoomFrame(time_s, image, truth, pose)

    def _motion(self, scene: RoomScene) -> Callable[[float], PersonPose | None]:
        if self.demo:
            script = demo_timeline(scene.walker.person, scene.seed)
            return lambda time_s: script.pose_at(time_s - EMPTY_S + DEMO_FROM_S) if time_s >= EMPTY_S else None
        motion = scene.walker.motion
        return lambda time_s: motion.pose_at((time_s - EMPTY_S) % motion.duration_s) if time_s >= EMPTY_S else None


def _focal(camera: Camera) -> Camera:
    matrix = camera.matrix.copy()
    matrix[[0, 1], [0, 1]] /= FAR
    return replace(camera, matrix=matrix)


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
    FaultFilm(Situation("the demo"), demo=True),
    FaultFilm(Situation("colours drift slowly", tone=_slow_colours), COLOUR, LIGHT),
    FaultFilm(Situation("lamps flicker", tone=_flicker), frozenset({A.FLICKER}), LIGHT),
    FaultFilm(Situation("out of focus", tone=_soft), frozenset({A.FOCUS}), frozenset({A.MOTION_BLUR})),
    FaultFilm(Situation("dark", tone=_dark), frozenset({A.DARK})),
    FaultFilm(Situation("too bright", tone=_bright), frozenset({A.SATURATED}), frozenset({A.FOCUS})),
    FaultFilm(Situation("long exposure"), frozenset({A.MOTION_BLUR}), exposed=EXPOSED),
    FaultFilm(Situation("floor that mirrors 35 %"), *MIRRORS, gloss=GLOSS),
    FaultFilm(Situation("the demo, floor that mirrors 35 %"), *MIRRORS, gloss=GLOSS, demo=True),
    FaultFilm(Situation("person far away"), view=_focal),
    FaultFilm(Situation("camera turned up"), view=_turned_up),
)
