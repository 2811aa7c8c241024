"""Kalibr's camchain.yaml: `zenocap calibrate convert camchain.yaml -o calibration.toml`.

Kalibr knows how its cameras stand to each other, and no floor: the world is that of the first camera, as if it were level.
"""

from pathlib import Path

import numpy as np
import yaml

from zenocap.common.camera.calibration_layouts import CalibrationLayout
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Entry, checked_camera
from zenocap.common.errors import UserError

TO_PREVIOUS = "T_cn_cnm1"  # from the camera before
NEEDED = ("camera_model", "distortion_model", "intrinsics", "distortion_coeffs", "resolution")
FISHEYE = {"radtan": False, "equidistant": True}
FIRST = np.diag([1.0, -1.0, -1.0, 1.0])  # from the world, x right, y up, z backwards, to the first camera


def is_camchain(path: Path) -> bool:
    """Raises OSError."""
    return "cam0:" in path.read_text(encoding="utf-8", errors="replace").splitlines()


def read(path: Path, up_axis: str) -> dict[str, Camera]:
    """Cameras by name.  up_axis: not used: the file has none.  Raises UserError."""
    try:
        tables = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: not YAML: {error}") from error
    if not isinstance(tables, dict) or not isinstance(tables.get("cam0"), dict):
        raise UserError(f"{path}: no camera in it: allowed: cam0 with {', '.join(NEEDED)}")
    cameras: dict[str, Camera] = {}
    world_to_camera = FIRST
    while isinstance(table := tables.get(name := f"cam{len(cameras)}"), dict):
        entry = Entry(path, name)
        for key in (*NEEDED, *[TO_PREVIOUS] * bool(cameras)):
            if key not in table:
                raise entry.missing(key, table)
        if table["camera_model"] != "pinhole":
            raise entry.error("camera_model", table["camera_model"], "pinhole")
        if table["distortion_model"] not in FISHEYE:
            raise entry.error("distortion_model", table["distortion_model"], " or ".join(FISHEYE))
        if cameras:
            world_to_camera = entry.numbers(TO_PREVIOUS, table[TO_PREVIOUS], (4, 4)) @ world_to_camera
        fu, fv, cu, cv = entry.numbers("intrinsics", table["intrinsics"], (4,))
        matrix = np.array([[fu, 0.0, cu], [0.0, fv, cv], [0.0, 0.0, 1.0]])
        cameras[name] = checked_camera(
            entry, name, table["resolution"], matrix, table["distortion_coeffs"], world_to_camera[:3, :3],
            world_to_camera[:3, 3], "y", FISHEYE[table["distortion_model"]],
        )  # fmt: skip
    return cameras


KALIBR = CalibrationLayout("kalibr", "camchain.yaml (Kalibr)", (".yaml", ".yml"), is_camchain, read="zenocap_kalibr:read")
