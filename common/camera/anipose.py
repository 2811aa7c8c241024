"""Calibration files of anipose and Pose2Sim (TOML), and those of caliscope.

[cam_01]
name = "cam01"
size = [640.0, 480.0]
matrix = [[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0]
rotation = [3.14, 0.0, 0.0]          # Rodrigues vector, world to camera
translation = [0.0, 1.0, 5.2]        # metres
fisheye = false                       # true: matrix and the four distortions are those of OpenCV's fisheye model
guessed = ["size"]                    # only where something is a guess, see `validation.GUESSES`
"""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.caliscope import caliscope_tables, is_caliscope
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera, rodrigues
from zenocap.common.camera.validation import Z_UP_TO_Y_UP, Entry, checked_camera, checked_up_axis
from zenocap.common.errors import UserError
from zenocap.common.toml_file import read_toml

KEYS = ("size", "matrix", "distortions", "rotation", "translation")


def read_anipose(path: Path, up_axis: str = "y") -> dict[str, Camera]:
    """Return the cameras by name, in the file's order, in the Y-up world.  Raises UserError."""
    checked_up_axis(path, up_axis)
    tables = read_toml(path)
    if is_caliscope(tables):
        tables = caliscope_tables(path, tables)
    cameras: dict[str, Camera] = {}
    for key, table in tables.items():
        if key == "metadata" or not isinstance(table, dict):
            continue
        camera = _camera(Entry(path, key), key, table, up_axis)
        if camera.name in cameras:
            raise Entry(path, key).error("name", repr(camera.name), "a name that no other camera has")
        cameras[camera.name] = camera
    if not cameras:
        raise UserError(f"{path}: no camera in it: allowed: a table [cam_01] with name, {', '.join(KEYS)}")
    return cameras


def _camera(entry: Entry, key: str, table: dict[str, object], up_axis: str) -> Camera:
    entry.require(KEYS, table)
    fisheye = table.get("fisheye", False)
    if not isinstance(fisheye, bool):
        raise entry.error("fisheye", json.dumps(fisheye, default=str), "true or false")
    name = table.get("name", key)
    if not isinstance(name, str):
        raise entry.error("name", name, "a string")
    size, matrix, distortions, rotation, translation = (table[each] for each in KEYS)
    guessed = table.get("guessed", [])
    return checked_camera(entry, name, size, matrix, distortions, rotation, translation, up_axis, fisheye, guessed)


def anipose_texts(
    path: Path, cameras: Mapping[str, Camera], up_axis: str = "y", error_px: float | None = None
) -> dict[Path, str]:
    """Text of the file at `path` for cameras in the Y-up world; up_axis: of the world in the file.  Raises UserError.

    error_px: of the reprojection, px; None: unknown, and not written.
    Reading returns the same floats, except for the conversion of the rotation to a Rodrigues vector and back.
    """
    if path.suffix.lower() != ".toml":
        raise UserError(f"{path}: suffix {path.suffix!r}: allowed when writing: .toml (anipose, Pose2Sim)")
    checked_up_axis(path, up_axis)
    blocks = []
    for number, camera in enumerate(cameras.values(), start=1):
        rotation = camera.rotation @ Z_UP_TO_Y_UP if up_axis == "z" else camera.rotation
        lens = Lens.of(camera)
        blocks.append(
            f"[cam_{number:02d}]\n"
            f"name = {_string(camera.name)}\n"
            f"size = {_row(np.array(lens.size))}\n"
            f"matrix = [{', '.join(_row(row) for row in lens.matrix)}]\n"
            f"distortions = {_row(lens.distortions)}\n"
            f"rotation = {_row(rodrigues(rotation))}\n"
            f"translation = {_row(camera.translation)}\n"
            f"fisheye = {str(lens.fisheye).lower()}\n"
            + (f"guessed = {json.dumps(camera.guessed)}\n" if camera.guessed else "")
        )
    error = "" if error_px is None else f"error = {float(error_px)!r}\n"
    blocks.append(f"[metadata]\nadjusted = false\n{error}")
    return {path: "\n".join(blocks)}


def _row(values: Floats | np.ndarray[tuple[int], np.dtype[np.int64]]) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"


def _string(text: str) -> str:
    """Return a TOML basic string: JSON's, without surrogate pairs and bare DEL, which TOML forbids."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
