"""What a calibration must satisfy before it becomes a `Camera`, whatever file it came from."""

import difflib
from collections.abc import Collection, Sequence
from pathlib import Path

import cv2
import numpy as np

from common.camera.pinhole import Camera, Floats

MAX_SIDE_PX = 16384
MAX_DISTANCE_M = 1000.0
MAX_FOCAL_PX = 1e6
DISTORTION_COUNTS = (4, 5, 8, 12, 14)  # the lens models OpenCV knows
# Coordinates of the Y-up world from those of the Z-up one: (x, y, z)_y-up = (y, z, x)_z-up, as TRC files have them.
Z_UP_TO_Y_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
UP_AXES = ("y", "z")


class CalibrationError(ValueError):
    """A calibration that cannot be used; the text names file, key, value and what is allowed."""


class Entry:
    """One camera's entry in a file: where errors point to."""

    def __init__(self, path: Path, key: str) -> None:
        self.path, self.key = path, key

    def error(self, key: str, value: object, allowed: str) -> CalibrationError:
        where = f"{self.key}.{key}" if self.key else key
        return CalibrationError(f"{self.path}: {where} = {value}: allowed: {allowed}")

    def missing(self, key: str, there: Collection[str]) -> CalibrationError:
        meant = difflib.get_close_matches(key, list(there), 1)
        hint = f"; did you mean {meant[0]!r}?" if meant else ""
        where = f"{self.key}.{key}" if self.key else key
        return CalibrationError(f"{self.path}: {where} is missing; there are: {', '.join(sorted(there)) or 'none'}{hint}")

    def numbers(self, key: str, value: object, *shapes: tuple[int, ...]) -> Floats:
        """`value` as finite floats of one of `shapes`; CalibrationError otherwise."""
        allowed = " or ".join(" x ".join(map(str, shape)) for shape in shapes) + " finite numbers"
        if not _only_numbers(value):
            raise self.error(key, value, allowed)
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise self.error(key, value, allowed) from None
        if array.shape not in shapes or not np.all(np.isfinite(array)):
            raise self.error(key, value, allowed)
        return array


def checked_camera(
    entry: Entry,
    name: str,
    size: object,
    matrix: object,
    distortions: object,
    rotation: object,
    translation: object,
    up_axis: str,
) -> Camera:
    """The camera in the Y-up world, from a file's values in OpenCV's convention, world to camera, metres.

    size: 2.  matrix: 3 x 3 px.  rotation: Rodrigues vector (3) or matrix (3 x 3).  Raises CalibrationError.
    """
    if not name:
        raise entry.error("name", repr(name), "at least one character")
    width, height = checked_size(entry, size)
    turn = checked_rotation(entry, rotation)
    shift = entry.numbers("translation", translation, (3,))
    if np.linalg.norm(shift) > MAX_DISTANCE_M:
        raise entry.error("translation", translation, f"metres, at most {MAX_DISTANCE_M:g} long; are these millimetres?")
    if up_axis == "z":
        turn = turn @ Z_UP_TO_Y_UP.T
    lens = entry.numbers("distortions", distortions, *((n,) for n in DISTORTION_COUNTS))
    return Camera(name, (width, height), checked_matrix(entry, matrix, (width, height)), lens, turn, shift)


def checked_size(entry: Entry, size: object) -> tuple[int, int]:
    """(width, height) in pixels."""
    sides = entry.numbers("size", size, (2,))
    if np.any(sides != np.round(sides)) or np.any(sides < 1) or np.any(sides > MAX_SIDE_PX):
        raise entry.error("size", size, f"width and height in whole pixels, from 1 to {MAX_SIDE_PX}")
    return int(sides[0]), int(sides[1])


def checked_matrix(entry: Entry, value: object, size: tuple[int, int]) -> Floats:
    """The camera matrix (3, 3) px: no skew, focal lengths above 0, the principal point near the image."""
    matrix = entry.numbers("matrix", value, (3, 3))
    if not np.array_equal(matrix[2], [0.0, 0.0, 1.0]) or matrix[1, 0] != 0:
        raise entry.error("matrix", value, "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    if abs(matrix[0, 1]) > 1e-3 * abs(matrix[0, 0]):
        raise entry.error("matrix", value, "no skew: [0][1] is 0")
    for axis, name in ((0, "fx"), (1, "fy")):
        if not 0 < matrix[axis, axis] <= MAX_FOCAL_PX:
            raise entry.error(f"matrix[{axis}][{axis}] ({name})", matrix[axis, axis], "focal length, above 0 to 1e6 px")
        if not -size[axis] <= matrix[axis, 2] <= 2 * size[axis]:
            limits = f"principal point, from {-size[axis]} to {2 * size[axis]} px for an image of {size[0]} x {size[1]}"
            raise entry.error(f"matrix[{axis}][2] (c{'xy'[axis]})", matrix[axis, 2], limits)
    return matrix


def checked_rotation(entry: Entry, value: object) -> Floats:
    """The rotation (3, 3) from a Rodrigues vector (3) or a matrix (3 x 3), orthonormal and right-handed."""
    rotation = entry.numbers("rotation", value, (3,), (3, 3))
    if rotation.shape == (3,):
        return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3) or np.linalg.det(rotation) < 0:
        raise entry.error("rotation", value, "a rotation: orthonormal rows and determinant +1")
    left, _, right = np.linalg.svd(rotation)  # what the file rounded off
    nearest: Floats = left @ right
    return nearest


def checked_up_axis(path: Path, up_axis: str) -> str:
    if up_axis not in UP_AXES:
        raise CalibrationError(f"{path}: up_axis = {up_axis!r}: allowed: 'y' or 'z'")
    return up_axis


def _only_numbers(value: object) -> bool:
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fiu"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return all(_only_numbers(item) for item in value)
    return isinstance(value, int | float) and not isinstance(value, bool)
