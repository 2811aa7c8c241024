"""Lens files: calibrations, ROS' `camera_info`, OpenCV's output, or a folder of these.

OpenCV's programs write image_width, image_height, camera_matrix and distortion_coefficients, or the same names with
capitals (Camera_Matrix), and fisheye_model for fisheye lenses, as YAML or XML.  Such a file is named after its camera.
"""

from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.opencv_storage import is_storage, stored_matrices
from zenocap.common.camera.ros_camera_info import is_ros_info, read_ros_info
from zenocap.common.camera.validation import Entry, checked_distortions, checked_matrix, checked_size
from zenocap.common.errors import UserError, reading

SUFFIXES = (".yaml", ".yml", ".xml")
NEEDED_KEYS = ("image_width", "image_height", "camera_matrix", "distortion_coefficients")


def read_lenses(path: Path | str) -> dict[str, Lens]:
    """Return the lenses of a file, or of the files of a folder, by camera.  Raises UserError."""
    path = Path(path)
    if path.is_dir():
        named = sorted(path.iterdir())
        files = [file for file in named if file.suffix.lower() in SUFFIXES and not file.name.startswith(".")]
        if not files:
            raise UserError(f"{path}: no {', '.join(SUFFIXES)} in this folder: allowed: one file for each camera")
        return _by_name(path, [lens for file in files for lens in _lenses(file)])
    return _by_name(path, _lenses(path))


def _by_name(path: Path, lenses: list[Lens]) -> dict[str, Lens]:
    found: dict[str, Lens] = {}
    for lens in lenses:
        if lens.name in found:
            raise UserError(f"{path}: camera {lens.name!r} twice: allowed: one lens for each camera")
        found[lens.name] = lens
    return found


def _lenses(path: Path) -> list[Lens]:
    if path.suffix.lower() in SUFFIXES and path.is_file():
        with reading(path):
            storage, ros_info = is_storage(path), is_ros_info(path)
        if storage:
            stored = {key.lower(): value for key, value in stored_matrices(path).items()}
            if "camera_matrix" in stored:
                return [_opencv_lens(path, stored)]
        elif ros_info:
            return [read_ros_info(path)]
    return [Lens.of(camera) for camera in read_calibration(path, placed=False).values()]


def _opencv_lens(path: Path, stored: dict[str, Floats]) -> Lens:
    entry = Entry(path, "")
    entry.require(NEEDED_KEYS, stored)
    size = checked_size(entry, [float(stored[key].item()) for key in NEEDED_KEYS[:2]])
    fisheye = bool(stored.get("fisheye_model", np.zeros(1)).any())
    matrix, key = checked_matrix(entry, stored["camera_matrix"], size), NEEDED_KEYS[3]
    distortions = checked_distortions(entry, stored[key].ravel(), size, matrix, fisheye=fisheye, key=key)
    return Lens(path.stem, size, matrix, distortions, fisheye)
