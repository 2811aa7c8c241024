"""Calibration files of caliscope: TOML with one table per camera in `[cameras]`, as tables of the anipose layout.

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

from collections.abc import Mapping
from pathlib import Path

from zenocap.common.camera.validation import Entry

KEYS = ("size", "matrix", "distortions", "rotation", "translation", "fisheye")


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
        number = table.get("cam_id", table.get("port", key))
        found[f"cam_{number}"] = {name: value for name, value in table.items() if name in KEYS}
    return found
