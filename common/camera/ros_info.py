"""ROS `camera_info` YAML: the intrinsics of one camera.  It does not say where the camera stands.

Only the block layout that ROS' camera_calibration writes is read: no YAML library is needed for it.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from common.camera.checks import DISTORTION_COUNTS, Entry, checked_matrix, checked_size
from common.camera.pinhole import Floats

LENS_MODELS = ("plumb_bob", "rational_polynomial")
WANTED = ("image_width", "image_height", "camera_name", "distortion_model", "camera_matrix", "distortion_coefficients")


@dataclass(frozen=True)
class Intrinsics:
    """size: (width, height) px.  matrix: (3, 3) px.  distortions: OpenCV's."""

    name: str
    size: tuple[int, int]
    matrix: Floats
    distortions: Floats


def is_ros_info(path: Path) -> bool:
    text = path.read_text(encoding="utf-8", errors="replace")
    return not text.startswith("%YAML") and "image_width" in text


def read_ros_info(path: Path) -> Intrinsics:
    """The camera's intrinsics.  Raises CalibrationError."""
    text, entry = path.read_text(encoding="utf-8", errors="replace"), Entry(path, "")
    scalars = dict(re.findall(r"^(\w+):[ \t]*(\S+)[ \t]*$", text, re.MULTILINE))
    lists = dict(re.findall(r"^(\w+):\s*\n(?:[ \t]+\w+:[^\[\n]*\n)*[ \t]+data:\s*\[([^\]]*)\]", text, re.MULTILINE))
    found = scalars | lists
    for wanted in WANTED:
        if wanted not in found:
            raise entry.missing(wanted, found)
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
