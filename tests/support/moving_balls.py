"""Cameras that see a moving body of three balls: a quick stand-in for a person."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tests.support.simulated_cameras import look
from tests.support.video_file import Sound, write_video
from zenocap.common.arrays import Floats, Mask
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.pinhole import Camera

FPS, SIZE = 30, (320, 240)
RADII_M = (0.25, 0.35, 0.3)


def ring(angles_deg: Sequence[float]) -> dict[str, Camera]:
    """Cameras at 5 m from the origin, 1.2 m high."""
    middle, cameras = np.array([0.0, 0.9, 0.0]), {}
    for k, angle in enumerate(np.radians(angles_deg)):
        name = f"cam{k + 1:02d}"
        cameras[name] = look(name, np.array([5 * np.sin(angle), 1.2, 5 * np.cos(angle)]), middle).resized(SIZE)
    return cameras


def centres(time_s: float, *, still: bool = False) -> Floats:
    """(3, 3) metres: a motion without period."""
    t = 0.0 if still else time_s
    x, z = 0.7 * np.sin(0.9 * t) + 0.2 * np.sin(2.3 * t), 0.6 * np.sin(1.3 * t + 1) + 0.2 * np.sin(3.1 * t)
    y = 0.12 * np.sin(5.0 * t) + 0.1 * np.sin(3.7 * t + 2)
    return np.array([[x, 0.4, z], [x, 1.0 + y, z], [x + 0.1 * np.sin(4 * t), 1.5 + 1.5 * y, z]])


def mask_of(camera: Camera, time_s: float, *, still: bool = False) -> Mask:
    """(height, width) of 0 and 255."""
    mask = np.zeros(camera.size[::-1], np.uint8)
    points = centres(time_s, still=still)
    depths = points @ camera.rotation[2] + camera.translation[2]
    for (u, v), depth, radius in zip(camera.project(points), depths, RADII_M, strict=True):
        place = (round(256 * u), round(256 * v))
        cv2.circle(mask, place, round(256 * camera.matrix[0, 0] * radius / depth), 255, -1, cv2.LINE_8, 8)
    return mask


def write_folder(
    folder: Path, cameras: dict[str, Camera], starts_s: dict[str, float], sounds: dict[str, Sound] | None = None,
    seconds: float = 5.0, *, still: bool = False, without_person: Sequence[str] = (),
    flash_s: tuple[float, float] | None = None,
) -> Path:  # fmt: skip
    """Folder with calibration, background pictures and videos that begin at the given times.

    flash_s: beginning and end of a light, in the time of `starts_s`.
    """
    (folder / "background").mkdir(parents=True)
    write_calibration(folder / "calibration.toml", cameras)
    rng = np.random.default_rng(0)
    for name, camera in cameras.items():
        empty = rng.integers(20, 60, (*camera.size[::-1], 3), dtype=np.uint8)
        cv2.imwrite(str(folder / "background" / f"{name}.png"), empty)
        images = []
        for k in range(round(seconds * FPS)):
            mask = mask_of(camera, starts_s[name] + k / FPS, still=still)
            seen = np.zeros_like(mask) if name in without_person else mask
            image = np.where(seen[..., None] > 0, np.uint8(220), empty)
            if flash_s is not None:
                begin_s = starts_s[name] + k / FPS
                lit = max(0.0, min(begin_s + 1 / FPS, flash_s[1]) - max(begin_s, flash_s[0])) * FPS
                image = np.clip(image + np.float64(80.0 * lit), 0, 255).astype(np.uint8)
            images.append(image)
        write_video(folder / "videos" / f"{name}.mp4", images, fps=FPS, sound=(sounds or {}).get(name))
    return folder
