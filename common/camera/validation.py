"""Validation of calibrations of all file formats."""

import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import FileNote, UserError, did_you_mean

# Plausible ranges, chosen by hand.
MAX_SIDE_PX = 16384
MAX_DISTANCE_M = 1000.0
MIN_FOCAL_PX, MAX_FOCAL_PX = 5.0, 1e6  # less: relative to the side of the image
OFF_CENTRE = 0.25  # share of a side between principal point and the centre, beyond which the size is questioned
MAX_SKEW = 1e-3  # relative to fx
ROTATION_TOLERANCE = 1e-3  # of the elements of R R^T

# Of the way to a corner, which a lens shows once: boards are seldom shown beyond; by what factor farther outside than a
# pinhole does a lens show a corner: a few percent, of real ones; steps.
INSIDE, OUTWARDS, STEPS = 0.8, 1.5, 120
FISHEYE_COUNT = 4  # coefficients of OpenCV's fisheye model
DISTORTION_COUNTS = (4, 5, 8, 12, 14)  # numbers of coefficients of OpenCV's lens models
# Z-up world to Y-up world: (x, y, z)_y-up = (y, z, x)_z-up, as in TRC files.
Z_UP_TO_Y_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
UP_AXES = ("y", "z")
GUESSES: Mapping[str, str] = {  # what of a camera may be a guess: the note
    "size": '{size} px is a guess: write the size of the video, and take "size" out of guessed',
    "vertical": "the vertical and the floor are a guess: calibrate again with the board on the floor (--floor SECONDS)",
}


@dataclass(frozen=True)
class Entry:
    """Entry of one camera in a file, for errors.  key: of its table, "" for the file."""

    path: Path
    key: str

    def error(self, key: str, value: object, allowed: str) -> UserError:
        """Error about the value of a key."""
        where = f"{self.key}.{key}" if self.key else key
        return UserError(f"{self.path}: {where} = {value}: allowed: {allowed}")

    def missing(self, key: str, present: Collection[str]) -> UserError:
        """Error about a missing key.  present: keys that are present."""
        where, there = f"{self.key}.{key}" if self.key else key, ", ".join(sorted(present)) or "none"
        return UserError(f"{self.path}: {where} is missing; there are: {there}{did_you_mean(key, present)}")

    def require(self, keys: Collection[str], present: Collection[str]) -> None:
        """Raise UserError for the first of `keys` that is not present."""
        for key in keys:
            if key not in present:
                raise self.missing(key, present)

    def numbers(self, key: str, value: object, *shapes: tuple[int, ...]) -> Floats:
        """Return `value` as finite floats of one of `shapes`; UserError otherwise."""
        try:
            array = np.asarray(value if _only_numbers(value) else np.nan, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            array = np.asarray(np.nan)
        if array.shape not in shapes or not np.all(np.isfinite(array)):
            allowed = " or ".join(" x ".join(map(str, shape)) for shape in shapes)
            raise self.error(key, value, f"{allowed} finite numbers")
        return array


def checked_camera(
    entry: Entry, name: str, size: object, matrix: object, distortions: object, rotation: object, translation: object,
    up_axis: str, fisheye: bool = False, guessed: object = (),
) -> Camera:  # fmt: skip
    """Return the camera in the Y-up world, from a file's values in OpenCV's convention, world to camera, metres.

    size: 2.  matrix: 3 x 3 px.  rotation: Rodrigues vector (3) or matrix (3 x 3).  fisheye: whether matrix and distortions
    are those of OpenCV's fisheye model; the camera is that of the rectified images then.  guessed: names of what the file
    marks as guessed, which is noted.  Raises UserError.
    """
    if not name:
        raise entry.error("name", repr(name), "at least one character")
    width, height = checked_size(entry, size)
    world_to_camera = checked_rotation(entry, rotation)
    shift = entry.numbers("translation", translation, (3,))
    if np.linalg.norm(shift) > MAX_DISTANCE_M:
        raise entry.error("translation", translation, f"metres, at most {MAX_DISTANCE_M:g} long; are these millimetres?")
    if up_axis == "z":
        world_to_camera = world_to_camera @ Z_UP_TO_Y_UP.T
    checked = checked_matrix(entry, matrix, (width, height))
    coefficients = checked_distortions(entry, distortions, (width, height), checked, fisheye=fisheye)
    camera = Camera(name, (width, height), checked, coefficients, world_to_camera, shift)
    if fisheye:
        lens = FisheyeLens((width, height), checked, coefficients)
        camera = replace(camera, matrix=lens.pinhole_matrix(), distortions=np.zeros(4), fisheye=lens)
    return _with_guesses(camera, entry, guessed)


def checked_distortions(
    entry: Entry, value: object, size: tuple[int, int], matrix: Floats, *, fisheye: bool, key: str = "distortions"
) -> Floats:
    """Return the coefficients of a lens of a checked size and matrix.  key: of `value`, in the file."""
    coefficients = entry.numbers(key, value, *((n,) for n in ((FISHEYE_COUNT,) if fisheye else DISTORTION_COUNTS)))
    allowed = "a lens that shows no direction twice"
    if fisheye and not FisheyeLens(size, matrix, coefficients).increases:
        raise entry.error(key, value, f"{allowed} within 60 degrees of its axis")
    if not fisheye and _wild(size, matrix, coefficients):
        allowed += ", and none far outside, in its images: k1, k2, p1, p2, k3"
        warnings.warn(str(entry.error(key, value, allowed)), FileNote, stacklevel=2)
    return coefficients


def _wild(size: tuple[int, int], matrix: Floats, coefficients: Floats) -> bool:
    """Whether a lens shows directions nearer to its axis than smaller ones, or corners far too early."""
    sides = np.array([(x, y) for x in (-0.5, size[0] - 0.5) for y in (-0.5, size[1] - 0.5)])
    corners = INSIDE * (sides - matrix[:2, 2]) / matrix[[0, 1], [0, 1]]
    rays = np.linspace(0.0, 2.0, STEPS + 1)[:, None, None] * corners  # to a pinhole's corners, and as far again
    points = cv2.convertPointsToHomogeneous(rays.reshape(-1, 2))
    seen = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), coefficients)[0].reshape(rays.shape)
    along = np.sum(seen * corners, axis=-1)
    before = np.maximum.accumulate(along) < np.sum(corners**2, axis=-1)
    return bool((before[:-1] & (np.diff(along, axis=0) <= 0.0)).any() or not before[round(STEPS / 2.0 / OUTWARDS)].all())


def checked_size(entry: Entry, size: object) -> tuple[int, int]:
    """Return (width, height) in pixels."""
    sides = entry.numbers("size", size, (2,))
    if np.any(sides != np.round(sides)) or np.any(sides < 1) or np.any(sides > MAX_SIDE_PX):
        raise entry.error("size", size, f"width and height in whole pixels, from 1 to {MAX_SIDE_PX}")
    return int(sides[0]), int(sides[1])


def checked_matrix(entry: Entry, value: object, size: tuple[int, int]) -> Floats:
    """Return the camera matrix (3, 3) px: no skew, focal lengths above 0, principal point near the image."""
    matrix = entry.numbers("matrix", value, (3, 3))
    if not np.array_equal(matrix[2], [0.0, 0.0, 1.0]) or matrix[1, 0] != 0:
        raise entry.error("matrix", value, "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    if abs(matrix[0, 1]) > MAX_SKEW * abs(matrix[0, 0]):
        raise entry.error("matrix", value, "no skew: [0][1] is 0")
    for axis, name in ((0, "fx"), (1, "fy")):
        if not MIN_FOCAL_PX <= matrix[axis, axis] <= MAX_FOCAL_PX:
            focal_allowed = f"focal length, from {MIN_FOCAL_PX:g} to {MAX_FOCAL_PX:g} px"
            raise entry.error(f"matrix[{axis}][{axis}] ({name})", matrix[axis, axis], focal_allowed)
        if not -size[axis] <= matrix[axis, 2] <= 2 * size[axis]:
            limits = f"principal point, from {-size[axis]} to {2 * size[axis]} px for an image of {size[0]} x {size[1]}"
            raise entry.error(f"matrix[{axis}][2] (c{'xy'[axis]})", matrix[axis, 2], limits)
    if (np.abs(matrix[:2, 2] / size - 0.5) > OFF_CENTRE).any():
        where = f"{entry.path}: {entry.key}".removesuffix(": ")
        text = f"principal point ({matrix[0, 2]:g}, {matrix[1, 2]:g}) px, size {size[0]} x {size[1]} px"
        warnings.warn(f"{where}: {text}: is it the size of the calibrated images?", FileNote, stacklevel=2)
    return matrix


def checked_rotation(entry: Entry, value: object) -> Floats:
    """Return the rotation (3, 3) of a Rodrigues vector (3) or a matrix (3 x 3), made exactly orthonormal."""
    rotation = entry.numbers("rotation", value, (3,), (3, 3))
    if rotation.shape == (3,):
        if np.linalg.norm(rotation) > 2.0 * np.pi:
            raise entry.error("rotation", value, "a Rodrigues vector, at most 2 pi long, radians; are these degrees?")
        return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64)
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=ROTATION_TOLERANCE) or np.linalg.det(rotation) < 0:
        raise entry.error("rotation", value, "a rotation: orthonormal rows and determinant +1")
    left, _, right = np.linalg.svd(rotation)  # removes the file's rounding
    nearest: Floats = left @ right
    return nearest


def checked_up_axis(path: Path, up_axis: str) -> str:
    """Return `up_axis` if it is "y" or "z"; UserError otherwise."""
    if up_axis not in UP_AXES:
        raise UserError(f"{path}: up_axis = {up_axis!r}: allowed: 'y' or 'z'")
    return up_axis


def _with_guesses(camera: Camera, entry: Entry, names: object) -> Camera:
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) and name in GUESSES for name in names):
        raise entry.error("guessed", names, f"names of {', '.join(GUESSES)}")
    for name in names:
        where = f"camera {camera.name!r}: " if name == "size" else ""
        text = GUESSES[name].format(size=" x ".join(map(str, camera.size)))
        warnings.warn(f"{entry.path}: {where}{text}", FileNote, stacklevel=2)
    return replace(camera, guessed=tuple(names))


def _only_numbers(value: object) -> bool:
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fiu"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return all(_only_numbers(item) for item in value)
    return isinstance(value, int | float) and not isinstance(value, bool)
