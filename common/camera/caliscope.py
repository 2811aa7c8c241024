"""Calibration files of caliscope, read as tables of the anipose layout.

[cameras.0]
cam_id = 0
size = [1280, 720]
rotation_count = 0                   # quarter turns of the images
matrix = [[900.0, 0.0, 640.0], [0.0, 900.0, 360.0], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0, 0.0]
rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]   # world to camera; or a Rodrigues vector
translation = [0.0, 1.0, 5.2]        # metres
ignore = false                       # true: the camera takes no part
"""

import re
import warnings
from collections.abc import Mapping
from pathlib import Path

from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Z_UP_TO_Y_UP, Entry
from zenocap.common.errors import FileNote

KEYS = ("size", "matrix", "distortions", "rotation", "translation", "fisheye", "guessed")


def is_caliscope(tables: Mapping[str, object]) -> bool:
    """True for the content of a file of caliscope."""
    cameras = tables.get("cameras")
    return isinstance(cameras, dict) and bool(cameras) and all(isinstance(one, dict) for one in cameras.values())


def caliscope_tables(path: Path, tables: Mapping[str, object]) -> dict[str, object]:
    """The cameras in use as tables of the anipose layout, named cam_N like caliscope's videos.  Raises UserError."""
    cameras = tables["cameras"]
    assert isinstance(cameras, dict)
    found: dict[str, object] = {}
    for key, table in cameras.items():
        if table.get("ignore") is True:
            continue
        entry = Entry(path, f"cameras.{key}")
        if table.get("rotation_count", 0) != 0:
            raise entry.error(
                "rotation_count", table["rotation_count"], "0: turn the videos, and calibrate the turned ones"
            )
        stated = {name: table[name] for name in ("cam_id", "port") if name in table}
        number = next(iter(stated.values()), key)
        if len({str(value) for value in (number, *stated.values(), *([key] if key.isdigit() else []))}) > 1:
            text = ", ".join(f"{name} = {value}" for name, value in stated.items())
            warnings.warn(f"{path}: cameras.{key}: {text}: taken for cam_{number}", FileNote, stacklevel=2)
        if f"cam_{number}" in found:
            raise entry.error(next(iter(stated), "cam_id"), number, "a number that no other camera has")
        found[f"cam_{number}"] = {name: value for name, value in table.items() if name in KEYS}
    return found


def caliscope_texts(path: Path, cameras: Mapping[str, Camera], up_axis: str = "y") -> dict[Path, str]:
    """Text of the file at `path` for cameras in the Y-up world; up_axis: of the world in the file.

    Caliscope numbers its cameras: by the last number in the name where all have different ones, otherwise from 0.
    """
    ends = [re.findall(r"\d+", camera.name)[-1:] for camera in cameras.values()]
    numbers = [int(end[0]) for end in ends if end]
    if len(set(numbers)) < len(cameras):
        numbers = list(range(len(cameras)))
    blocks = []
    for number, camera in zip(numbers, cameras.values(), strict=True):
        lens = Lens.of(camera)
        rotation = camera.rotation @ Z_UP_TO_Y_UP if up_axis == "z" else camera.rotation
        blocks.append(
            f"[cameras.{number}]\n"
            f"cam_id = {number}\n"
            f"rotation_count = 0\n"
            f"ignore = false\n"
            f"size = {list(lens.size)}\n"
            f"matrix = {lens.matrix.tolist()}\n"
            f"distortions = {lens.distortions.tolist()}\n"
            f"translation = {camera.translation.tolist()}\n"
            f"rotation = {rotation.tolist()}\n"
            f"fisheye = {str(lens.fisheye).lower()}\n" + (f"guessed = {list(camera.guessed)}\n" if camera.guessed else "")
        )
    return {path: "\n".join(blocks)}
