"""Calibrations as OpenCV FileStorage in EasyMocap's layout: `intri.yml` and `extri.yml`.

`intri.yml` has K_name and dist_name, `extri.yml` Rot_name or R_name and T_name: world to camera, metres.
`extri.yml` is the file to name; `intri.yml` lies beside it.
"""

from pathlib import Path

import cv2
import numpy as np

from common.camera.checks import CalibrationError, Entry, checked_camera, checked_up_axis
from common.camera.pinhole import Camera, Floats


def read_opencv(path: Path, up_axis: str = "y") -> dict[str, Camera]:
    """Cameras by name, of the Y-up world.  Raises CalibrationError."""
    checked_up_axis(path, up_axis)
    beside = path.with_name(path.name.replace("extri", "intri"))
    extrinsics = _matrices(path)
    intrinsics = extrinsics if beside == path else _matrices(beside)
    names = [key[2:] for key in extrinsics if key.startswith("T_")]
    if not names:
        allowed = "extri.yml with T_name and Rot_name for each camera, intri.yml beside it with K_name and dist_name"
        raise CalibrationError(f"{path}: no camera in it: there are: {', '.join(extrinsics) or 'none'}; allowed: {allowed}")
    return {name: _camera(path, beside, name, extrinsics, intrinsics, up_axis) for name in names}


def _camera(
    path: Path, beside: Path, name: str, extrinsics: dict[str, Floats], intrinsics: dict[str, Floats], up_axis: str
) -> Camera:
    inner, outer = Entry(beside, ""), Entry(path, "")
    for wanted in (f"K_{name}", f"dist_{name}"):
        if wanted not in intrinsics:
            raise inner.missing(wanted, intrinsics)
    rotation = extrinsics.get(f"Rot_{name}", extrinsics.get(f"R_{name}"))
    if rotation is None:
        raise outer.missing(f"Rot_{name}", extrinsics)
    if rotation.size == 3:
        rotation = rotation.reshape(3)
    matrix = intrinsics[f"K_{name}"]
    if f"H_{name}" in intrinsics and f"W_{name}" in intrinsics:
        size = np.array([intrinsics[f"W_{name}"].item(), intrinsics[f"H_{name}"].item()])
    elif matrix.shape == (3, 3):
        # EasyMocap leaves the size out; a centred principal point tells it.
        size = np.round(2 * matrix[:2, 2] + 1)
    else:
        raise inner.error(f"K_{name}", matrix.tolist(), "3 x 3 finite numbers")
    lens, shift = intrinsics[f"dist_{name}"].reshape(-1), extrinsics[f"T_{name}"].reshape(-1)
    return checked_camera(Entry(path, name), name, size, matrix, lens, rotation, shift, up_axis)


def _matrices(path: Path) -> dict[str, Floats]:
    if not path.exists():
        raise CalibrationError(f"{path}: no such calibration file; allowed: extri.yml with intri.yml beside it")
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        root = storage.root()
        found = {key: _value(root.getNode(key)) for key in root.keys()}  # noqa: SIM118  (not a dict)
    except (cv2.error, SystemError) as error:
        raise CalibrationError(f"{path}: not OpenCV FileStorage (%YAML:1.0): {error}") from error
    return {key: value for key, value in found.items() if value is not None}


def _value(node: cv2.FileNode) -> Floats | None:
    if node.isMap():
        matrix = node.mat()
        return None if matrix is None else np.asarray(matrix, dtype=np.float64)
    return np.array([node.real()]) if node.isReal() or node.isInt() else None
