"""Calibration files: one reader for every layout, told apart by what the file is."""

import difflib
from pathlib import Path

from common.camera.anipose import read_anipose, write_anipose
from common.camera.checks import CalibrationError
from common.camera.opencv_storage import read_opencv
from common.camera.pinhole import Camera
from common.camera.qualisys import read_qualisys
from common.camera.ros_info import is_ros_info, read_ros_info

__all__ = ["CalibrationError", "camera_named", "read_calibration", "write_calibration"]

LAYOUTS = ".toml (anipose, Pose2Sim), extri.yml beside intri.yml (OpenCV, EasyMocap), .qca.txt or .xml (Qualisys)"


def read_calibration(path: Path | str, up_axis: str = "y") -> dict[str, Camera]:
    """Cameras by name, in the file's order, of the Y-up world, metres.

    up_axis: "y" or "z", the file's own.  A Z-up world is turned such that (x, y, z)_y-up = (y, z, x)_z-up.
    Raises CalibrationError, whose text names file, key, value and what is allowed.
    """
    path = Path(path)
    if path.is_dir():
        raise CalibrationError(f"{path}: a folder; allowed: a file {LAYOUTS}")
    if not path.exists():
        raise CalibrationError(f"{path}: no such calibration file; allowed: {LAYOUTS}")
    try:
        match path.suffix.lower():
            case ".toml":
                return read_anipose(path, up_axis)
            case ".txt" | ".xml":
                return read_qualisys(path, up_axis)
            case ".yml" | ".yaml":
                if is_ros_info(path):
                    read_ros_info(path)  # its own mistakes first
                    raise CalibrationError(
                        f"{path}: camera_info has intrinsics only, not where the camera stands; "
                        "allowed: a calibration with rotation and translation (zenocap calibrate board, scene or lines)"
                    )
                return read_opencv(path, up_axis)
            case suffix:
                raise CalibrationError(f"{path}: suffix {suffix!r}: allowed: {LAYOUTS}")
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error.strerror}") from error


def write_calibration(path: Path | str, cameras: dict[str, Camera], up_axis: str = "y", error_px: float = 0.0) -> None:
    """Write the anipose layout, whole or not at all.  Raises CalibrationError, OSError."""
    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise CalibrationError(f"{path}: suffix {path.suffix!r}: allowed when writing: .toml (anipose, Pose2Sim)")
    write_anipose(path, cameras.values(), up_axis, error_px)


def camera_named(cameras: dict[str, Camera], name: str, path: Path | str) -> Camera:
    """The camera of that name; CalibrationError lists the ones there are in the file at `path`."""
    if name in cameras:
        return cameras[name]
    meant = difflib.get_close_matches(name, list(cameras), 1)
    hint = f"; did you mean {meant[0]!r}?" if meant else ""
    raise CalibrationError(f"{path}: no camera {name!r}; there are: {', '.join(cameras) or 'none'}{hint}")
