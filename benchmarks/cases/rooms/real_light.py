"""Silhouettes of a real clip whose light is changed: plates of the empty room, then the video to and fro, 25 s.

There is no true silhouette: overlap is that with the silhouette of the same frame by the same method without a change.  The
plates have no noise of a camera; PLATE_NOISE is added.
"""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from benchmarks.cases.rooms.film import EMPTY_S, FPS, LENGTH_S, Scene, Tone
from benchmarks.cases.rooms.silhouettes import NAMED, OVERLAP, UNUSABLE, overlap
from benchmarks.harness.case import SHARED, Case, Figures, Kind, case
from zenocap.common.arrays import Image, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import parse_background
from zenocap.common.video.reader import VideoReader
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, viewer_setup

CLIP = "real_beam4"  # with pictures of the empty room
CHANGES = ("light fades by 40 %", "lamp switched off", "white balance jumps", "noise", "compression")
PLATE_NOISE = 2.0  # grey levels


def film(plate: Image, images: list[Image]) -> Iterator[tuple[float, Image]]:
    """Times (s) and images: the empty room for EMPTY_S, then the video to and fro."""
    rng = np.random.default_rng(0)
    there_and_back = images + images[-2:0:-1]
    empty = int(EMPTY_S * FPS)
    for k in range(int(LENGTH_S * FPS)):
        if k < empty:
            noisy = np.clip(plate + rng.normal(0.0, PLATE_NOISE, plate.shape), 0, 255).astype(np.uint8)
            yield k / FPS, noisy
        else:
            yield k / FPS, there_and_back[(k - empty) % len(there_and_back)]


def masks(camera: Camera, method: str, shots: list[tuple[float, Image]], tone: Tone | None) -> list[Mask]:
    """Silhouettes (height, width) from EMPTY_S on; empty where there is none."""
    size = (shots[0][1].shape[1], shots[0][1].shape[0])
    setup = viewer_setup(camera.name, camera.resized(size), parse_background(method, Path()), True)
    state, place, found = LearningBackground(), None, []
    scene = Scene(0, size)
    for number, (time_s, image) in enumerate(shots):
        seen = image if tone is None else tone(scene, time_s, image)
        mask: Mask | None = None
        if place is None:
            state, place = learn(setup, state, seen)
        else:
            place, mask, _ = segment(setup, place, Frame(number, round(time_s * 1e9), seen))
        if time_s >= EMPTY_S:
            found.append(np.zeros(image.shape[:2], np.uint8) if mask is None else mask)
    return found


def run(one: Case) -> Figures:
    """One camera, that of the seed's number.  Options: method, height (rows of the images)."""
    folder = SHARED / "clips" / CLIP
    camera = load_rig(folder).viewers[one.seed].camera
    images = [_scaled(image, one.option("height", 320)) for image in _images(folder / "videos" / f"{camera.name}.mp4")]
    plate = cv2.imread(str(folder / "background" / f"{camera.name}.png"))
    assert plate is not None, f"{folder}/background/{camera.name}.png"
    height, width = images[0].shape[:2]
    shots = list(film(np.asarray(cv2.resize(plate, (width, height), interpolation=cv2.INTER_AREA)), images))
    method = one.option("method", "adaptive")
    plain, changed = (masks(camera, method, shots, tone) for tone in (None, NAMED[one.film].tone))
    both = np.array([overlap(a, b) for a, b in zip(changed, plain, strict=True) if b.any()])
    return {"overlap": float(both.mean()), "unusable": 100.0 * float((both < UNUSABLE).mean())}


def _images(path: Path) -> Iterator[Image]:
    with VideoReader(path) as reader:
        while (frame := reader.next()) is not None:
            yield frame.image()


def _scaled(image: Image, height: int) -> Image:
    width = round(image.shape[1] * height / image.shape[0])
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA))


REAL_LIGHT = Kind(
    "real-light",
    "`real_beam4`, four cameras, 180×320: pictures of the empty room, then the man to and fro for 20 s, and the light "
    "changed; overlap with the silhouette without the change, mean of the cameras and the worst one.",
    run,
    (OVERLAP[0], OVERLAP[2]),
    {f"{change}, {method}": case(change, method=method) for change in CHANGES for method in ("first:60", "adaptive")},
    case(CHANGES[0], height=96),
    seeds=4,
    rows="change, background",
    inputs=lambda _: (f"clips/{CLIP}",),
)
