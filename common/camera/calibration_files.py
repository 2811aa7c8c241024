"""Calibration files: one reader for all layouts, chosen by suffix and content."""

import difflib
from pathlib import Path

from zenocap.common.camera.anipose import read_anipose, write_anipose
from zenocap.common.camera.opencv_yaml import is_ros_info, read_opencv, read_ros_info
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.qualisys import read_qualisys
from zenocap.common.errors import UserError

__all__ = ["UserError", "camera_named", "read_calibration", "write_calibration"]

LAYOUTS = ".toml (anipose, Pose2Sim), extri.yml beside intri.yml (OpenCV, EasyMocap), .qca.txt or .xml (Qualisys)"


def read_calibration(path: Path | str, up_axis: str = "y") -> dict[str, Camera]:
    """Return the cameras by name, in the file's order, in the Y-up world, metres.

    up_axis: "y" or "z", of the world in the file.  A Z-up world is converted as (x, y, z)_y-up = (y, z, x)_z-up.
    Raises UserError that names file, key, value and allowed values.
    """
    path = Path(path)
    if path.is_dir():
        raise UserError(f"{path}: a folder; allowed: a file {LAYOUTS}")
    if not path.exists():
        raise UserError(f"{path}: no such calibration file; allowed: {LAYOUTS}")
    try:
        match path.suffix.lower():
            case ".toml":
                return read_anipose(path, up_axis)
            case ".txt" | ".xml":
                return read_qualisys(path, up_axis)
            case ".yml" | ".yaml":
                if is_ros_info(path):
                    read_ros_info(path)  # errors of the file itself come first
                    raise UserError(
                        f"{path}: camera_info has intrinsics only, no position and orientation; "
                        "allowed: a calibration with rotation and translation (zenocap calibrate board, scene or lines)"
                    )
                return read_opencv(path, up_axis)
            case suffix:
                raise UserError(f"{path}: suffix {suffix!r}: allowed: {LAYOUTS}")
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror}") from error


def write_calibration(path: Path | str, cameras: dict[str, Camera], up_axis: str = "y", error_px: float = 0.0) -> None:
    """Write the anipose layout atomically.  Raises UserError, OSError."""
    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise UserError(f"{path}: suffix {path.suffix!r}: allowed when writing: .toml (anipose, Pose2Sim)")
    write_anipose(path, cameras.values(), up_axis, error_px)


def camera_named(cameras: dict[str, Camera], name: str, path: Path | str) -> Camera:
    """Return the camera of that name.  path: of the file, for the UserError, which lists its cameras."""
    if name in cameras:
        return cameras[name]
    similar = difflib.get_close_matches(name, list(cameras), 1)
    hint = f"; did you mean {similar[0]!r}?" if similar else ""
    raise UserError(f"{path}: no camera {name!r}; there are: {', '.join(cameras) or 'none'}{hint}")
