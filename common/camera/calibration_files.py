"""Calibration files: one reader for all layouts, chosen by suffix and content, and one writer."""

import warnings
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.anipose import anipose_texts
from zenocap.common.camera.calibration_layouts import LAYOUTS, layout_of, readable
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import checked_up_axis
from zenocap.common.errors import FileNote, UserError, did_you_mean

__all__ = ["UserError", "camera_named", "read_calibration", "write_calibration"]


# Beyond which the unit is questioned: of cameras from the origin; from the floor, of the point they look at and of cameras.
# By hand: rooms are a few metres, halls 30; the shared clips look at 0.6 to 1 m, 2 to 3.3 feet; level cameras look at 2 m.
FAR_M, HIGH_M, MOUNTED_M, WEAK = 100.0, 1.8, 2.5, 0.05  # WEAK: of the strongest direction; weaker ones are the origin's
SAME_M, UPRIGHT = 0.01, 0.7  # between two cameras; of up in their pictures, along an axis of the world; by hand
MANY = 0.3  # share of the cameras behind which the point they look at is questioned: none of the shared clips; by hand


def read_calibration(path: Path | str, up_axis: str = "y", *, placed: bool = True) -> dict[str, Camera]:
    """Return the cameras by name, in the file's order, in the Y-up world, metres.

    placed: whether the places of the cameras are used, and questioned.
    up_axis: "y" or "z", of the world in the file.  A Z-up world is converted as (x, y, z)_y-up = (y, z, x)_z-up.
    Raises UserError that names file, key, value and allowed values.
    """
    path = Path(path)
    if path.is_dir():
        raise UserError(f"{path}: a folder; allowed: a file {readable()}")
    if not path.exists():
        raise UserError(f"{path}: no such calibration file; allowed: {readable()}")
    try:
        cameras = layout_of(path).cameras(path, up_axis)
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error
    each = list(cameras.values())
    if placed and each and (note := unit_note(each) or axes_note(each)):
        warnings.warn(f"{path}: {note}", FileNote, stacklevel=2)
    return cameras


def unit_note(cameras: Sequence[Camera]) -> str:
    """Suspicion of another unit than metres, in words; empty without one.  Yards look like metres.  One camera or more."""
    farthest = max(cameras, key=lambda camera: float(np.linalg.norm(camera.centre)))
    distance = float(np.linalg.norm(farthest.centre))
    where = f"camera {farthest.name!r} is {distance:.0f} m from the origin"
    if distance > FAR_M:
        return f"{where}: is the file in centimetres or inches? allowed: metres"
    height = float(_looked_at(cameras)[0][1])
    if height > HIGH_M and np.median([camera.centre[1] for camera in cameras]) > MOUNTED_M:
        doubt = "is the file in feet or inches, or another axis its vertical? allowed: metres"
        return f"{where}, and the cameras look at a point {height:.1f} m high: {doubt}"
    return ""


def axes_note(cameras: Sequence[Camera]) -> str:
    """Suspicion of other axes, or of the opposite direction, in words; empty without one.  One camera or more."""
    for one, other in combinations(cameras, 2):
        if np.linalg.norm(one.centre - other.centre) < SAME_M:
            same = f"cameras {one.name!r} and {other.name!r} are at the same place"
            return f"{same}: are rotation and translation from camera to world? allowed: from world to camera"
    up = np.median([-camera.rotation[1] for camera in cameras], axis=0)
    axis = int(np.argmax(np.abs(up)))
    if abs(up[axis]) > UPRIGHT and (axis != 1 or up[axis] < 0.0):
        direction = f"{'-' if up[axis] < 0.0 else ''}{'XYZ'[axis]}"
        doubt = "is another axis its vertical (--up-axis), or are the axes of its cameras those of OpenGL?"
        return f"up in the pictures of most cameras is {direction}, not Y: {doubt} allowed: OpenCV's axes"
    point, sure = _looked_at(cameras)
    behind = [camera.name for camera in cameras if camera.rotation[2] @ (point - camera.centre) < 0.0]
    if sure and len(behind) >= MANY * len(cameras):
        doubt = "are the rotations transposed, or from camera to world? allowed: from world to camera"
        return f"what the cameras look at is behind {', '.join(behind)}: {doubt}"
    return ""


def _looked_at(cameras: Sequence[Camera]) -> tuple[Floats, bool]:
    """(3,) point nearest to all optical axes, and whether they cross enough to give it without the origin."""
    across = np.array([np.eye(3) - np.outer(camera.rotation[2], camera.rotation[2]) for camera in cameras])
    offset = np.einsum("nij,nj->i", across, np.array([camera.centre for camera in cameras]))
    point, _, rank, _ = np.linalg.lstsq(across.sum(axis=0), offset, WEAK)
    return point, rank == 3


def write_calibration(
    path: Path | str, cameras: dict[str, Camera], up_axis: str = "y", error_px: float | None = None, *, new: bool = False
) -> None:
    """Write the anipose layout atomically.  error_px: see `anipose_texts`.  new: no file is replaced.

    Raises UserError, OSError.
    """
    _write(anipose_texts(Path(path), cameras, up_axis, error_px), new=new)


def _write(files: dict[Path, str], *, new: bool) -> None:
    """Write the texts of files; with `new` none of them where one exists."""
    written: list[Path] = []
    try:
        for file, text in files.items():
            write_atomically(file, text.encode(), new=new)
            written.append(file)
    except OSError:
        for file in written if new else ():
            file.unlink(missing_ok=True)
        raise


def camera_named(cameras: dict[str, Camera], name: str, path: Path | str) -> Camera:
    """Return the camera of that name.  path: of the file, for the UserError, which lists its cameras."""
    if name in cameras:
        return cameras[name]
    raise UserError(f"{path}: no camera {name!r}; there are: {', '.join(cameras) or 'none'}{did_you_mean(name, cameras)}")


def write_layout(
    path: Path | str, cameras: dict[str, Camera], layout: str, up_axis: str = "y", *, new: bool = False
) -> list[Path]:
    """Write cameras of the Y-up world in a layout, see `LAYOUTS`; returns the files.

    up_axis: of the world in the files.  new: no file is replaced.

    Raises UserError, OSError.
    """
    path = Path(path)
    checked_up_axis(path, up_axis)
    files = LAYOUTS.row(layout).texts(path, cameras, up_axis)
    _write(files, new=new)
    return list(files)
