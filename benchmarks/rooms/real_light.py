"""Silhouettes of a real clip whose light is changed: plates of the empty room, then the video to and fro, 25 s.

    python -m benchmarks.rooms.real_light [--clip real_beam4] [--methods first:60,adaptive] [--height 320]

Every change is a tone of `benchmarks.rooms.situations`, on the finished images.  There is no true silhouette: overlap is
that with the silhouette of the same frame by the same method without a change, mean of all cameras, the worst in brackets.
unusable: share of the frames with an overlap below UNUSABLE.  The plates have no noise of a camera; PLATE_NOISE is added.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from benchmarks.clips import SHARED
from benchmarks.rooms.__main__ import UNUSABLE, overlap
from benchmarks.rooms.film import EMPTY_S, FPS, LENGTH_S, Scene, Tone
from benchmarks.rooms.situations import SITUATIONS
from benchmarks.table import table
from zenocap.common.arrays import Image, Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import parse_background
from zenocap.common.video.reader import VideoReader
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, viewer_setup

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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", default="real_beam4", help="of the shared clips, with pictures of the empty room")
    parser.add_argument("--methods", default="first:60,adaptive")
    parser.add_argument("--height", type=int, default=320, help="rows of the images")
    options = parser.parse_args()
    folder = SHARED / "clips" / options.clip
    rig = load_rig(folder)
    tones = {one.name: one.tone for one in SITUATIONS if one.name in CHANGES}
    overlaps: dict[tuple[str, str], list[np.ndarray]] = {}
    for viewer in rig.viewers:
        camera, name = viewer.camera, viewer.camera.name
        images = [_scaled(image, options.height) for image in _images(folder / "videos" / f"{name}.mp4")]
        plate = cv2.imread(str(folder / "background" / f"{name}.png"))
        assert plate is not None, f"{folder}/background/{name}.png"
        height, width = images[0].shape[:2]
        shots = list(film(np.asarray(cv2.resize(plate, (width, height), interpolation=cv2.INTER_AREA)), images))
        for method in options.methods.split(","):
            plain = masks(camera, method, shots, None)
            for change, tone in tones.items():
                changed = masks(camera, method, shots, tone)
                both = [overlap(a, b) for a, b in zip(changed, plain, strict=True) if b.any()]
                overlaps.setdefault((change, method), []).append(np.array(both))
    cells = []
    for (change, method), of in overlaps.items():
        means, bad = [float(one.mean()) for one in of], [float((one < UNUSABLE).mean()) for one in of]
        cells.append((change, method, f"{np.mean(means):.3f} ({min(means):.3f})", f"{np.mean(bad):.0%} ({max(bad):.0%})"))
    print(table("", ("change", "method", "overlap", "unusable"), cells))


def _images(path: Path) -> Iterator[Image]:
    with VideoReader(path) as reader:
        while (frame := reader.next()) is not None:
            yield frame.image()


def _scaled(image: Image, height: int) -> Image:
    width = round(image.shape[1] * height / image.shape[0])
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA))


if __name__ == "__main__":
    main()
