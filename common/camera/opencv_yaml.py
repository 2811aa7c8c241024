"""Calibrations in YAML: OpenCV FileStorage in EasyMocap's layout, and ROS `camera_info`.

EasyMocap: `intri.yml` has K_name and dist_name, `extri.yml` Rot_name or R_name and T_name: world to camera, metres.
`extri.yml` is the file to name; `intri.yml` is beside it.

`camera_info` has intrinsics only.  It is read in the block layout that ROS' camera_calibration writes, for which no YAML
library is needed.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import (
    DISTORTION_COUNTS,
    Entry,
    checked_camera,
    checked_matrix,
    checked_size,
    checked_up_axis,
)
from zenocap.common.errors import UserError

MAX_YAML_BYTES = 1 << 20  # of a file of matrices of a few numbers; chosen by hand
MAX_MATRIX_SIDE = 1000  # rows or columns declared; calibrations have up to 14; chosen by hand


def read_opencv(path: Path, up_axis: str = "y") -> dict[str, Camera]:
    """Return the cameras by name in the Y-up world.  Raises UserError."""
    checked_up_axis(path, up_axis)
    beside = path.with_name(path.name.replace("extri", "intri"))
    extrinsics = _matrices(path)
    intrinsics = extrinsics if beside == path else _matrices(beside)
    names = [key[2:] for key in extrinsics if key.startswith("T_")]
    if not names:
        allowed = "extri.yml with T_name and Rot_name for each camera, intri.yml beside it with K_name and dist_name"
        raise UserError(f"{path}: no camera in it: there are: {', '.join(extrinsics) or 'none'}; allowed: {allowed}")
    return {name: _camera(path, beside, name, extrinsics, intrinsics, up_axis) for name in names}


def _camera(
    path: Path, beside: Path, name: str, extrinsics: dict[str, Floats], intrinsics: dict[str, Floats], up_axis: str
) -> Camera:
    intrinsic, extrinsic = Entry(beside, ""), Entry(path, "")
    for required_key in (f"K_{name}", f"dist_{name}"):
        if required_key not in intrinsics:
            raise intrinsic.missing(required_key, intrinsics)
    rotation = extrinsics.get(f"Rot_{name}", extrinsics.get(f"R_{name}"))
    if rotation is None:
        raise extrinsic.missing(f"Rot_{name}", extrinsics)
    if rotation.size == 3:
        rotation = rotation.reshape(3)
    matrix = intrinsics[f"K_{name}"]
    if f"H_{name}" in intrinsics and f"W_{name}" in intrinsics:
        size = np.array([intrinsics[f"W_{name}"].item(), intrinsics[f"H_{name}"].item()])
    elif matrix.shape == (3, 3):
        # EasyMocap omits the size: a centred principal point is assumed.
        size = np.round(2 * matrix[:2, 2] + 1)
    else:
        raise intrinsic.error(f"K_{name}", matrix.tolist(), "3 x 3 finite numbers")
    lens, shift = intrinsics[f"dist_{name}"].reshape(-1), extrinsics[f"T_{name}"].reshape(-1)
    return checked_camera(Entry(path, name), name, size, matrix, lens, rotation, shift, up_axis)


def _matrices(path: Path) -> dict[str, Floats]:
    if not path.exists():
        raise UserError(f"{path}: no such calibration file; allowed: extri.yml with intri.yml beside it")
    _check_storage(path)
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        root = storage.root()
        found = {key: _value(root.getNode(key)) for key in root.keys()}  # noqa: SIM118  (not a dict)
    except (cv2.error, SystemError) as error:
        raise UserError(f"{path}: not OpenCV FileStorage (%YAML:1.0): {error}") from error
    return {key: value for key, value in found.items() if value is not None}


def _value(node: cv2.FileNode) -> Floats | None:
    if node.isMap():
        matrix = node.mat()
        return None if matrix is None else np.asarray(matrix, dtype=np.float64)
    return np.array([node.real()]) if node.isReal() or node.isInt() else None


def _check_storage(path: Path) -> None:
    """Refuse what makes OpenCV's parser take unlimited time or memory."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_YAML_BYTES + 1)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(content) > MAX_YAML_BYTES:
        raise UserError(f"{path}: more than {MAX_YAML_BYTES} bytes: allowed: a calibration file below that")
    if binary := re.search(rb"!!binary|!<[^>\n]*binary|\$base64\$", content):
        raise UserError(f"{path}: {binary.group().decode(errors='replace')[:40]}: allowed: matrices of numbers as text")
    for key, count in re.findall(rb"\b(rows|cols)\W{1,9}(\d+)", content):
        if len(count) > 4 or int(count) > MAX_MATRIX_SIDE:
            found = f"{key.decode()}: {count[:20].decode()}"
            raise UserError(f"{path}: {found}: allowed: matrices with up to {MAX_MATRIX_SIDE} rows and columns")


LENS_MODELS = ("plumb_bob", "rational_polynomial")
NEEDED_KEYS = ("image_width", "image_height", "camera_name", "distortion_model", "camera_matrix", "distortion_coefficients")


@dataclass(frozen=True)
class Intrinsics:
    """size: (width, height) px.  matrix: (3, 3) px.  distortions: OpenCV's."""

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortions: Floats


def is_ros_info(path: Path) -> bool:
    """Whether a YAML file has the key of a ROS `camera_info`."""
    text = path.read_text(encoding="utf-8", errors="replace")
    return not text.startswith("%YAML") and "image_width" in text


def read_ros_info(path: Path) -> Intrinsics:
    """Return the intrinsics in a ROS `camera_info` file.  Raises UserError."""
    text, entry = path.read_text(encoding="utf-8", errors="replace"), Entry(path, "")
    scalars = dict(re.findall(r"^(\w+):[ \t]*(\S+)[ \t]*$", text, re.MULTILINE))
    lists = dict(re.findall(r"^(\w+):\s*\n(?:[ \t]+\w+:[^\[\n]*\n)*[ \t]+data:\s*\[([^\]]*)\]", text, re.MULTILINE))
    found = scalars | lists
    for required_key in NEEDED_KEYS:
        if required_key not in found:
            raise entry.missing(required_key, found)
    if scalars["distortion_model"] not in LENS_MODELS:
        raise entry.error("distortion_model", scalars["distortion_model"], " or ".join(LENS_MODELS))
    size = checked_size(entry, [_number(entry, key, scalars[key]) for key in ("image_width", "image_height")])
    matrix = entry.numbers("camera_matrix", _row(entry, "camera_matrix", lists["camera_matrix"]), (9,)).reshape(3, 3)
    lens = _row(entry, "distortion_coefficients", lists["distortion_coefficients"])
    distortions = entry.numbers("distortion_coefficients", lens, *((n,) for n in DISTORTION_COUNTS))
    return Intrinsics(scalars["camera_name"], size, checked_matrix(entry, matrix, size), distortions)


def _row(entry: Entry, key: str, text: str) -> list[float]:
    return [_number(entry, key, word) for word in text.replace(",", " ").split()]


def _number(entry: Entry, key: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise entry.error(key, repr(text), "a number") from None
