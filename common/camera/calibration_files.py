"""Calibration files: one reader for all layouts, chosen by suffix and content, and one writer."""

import difflib
from pathlib import Path

from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.anipose import read_anipose, write_anipose
from zenocap.common.camera.caliscope import caliscope_text
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.opencv_storage import WITH_POSITION, easymocap_texts, intrinsics_beside, is_storage, read_opencv
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.qualisys import qualisys_text, read_qualisys
from zenocap.common.camera.ros_camera_info import is_ros_info, read_ros_info, ros_info_text
from zenocap.common.camera.validation import checked_up_axis
from zenocap.common.errors import UserError

__all__ = ["UserError", "camera_named", "read_calibration", "write_calibration"]

LAYOUTS = (
    ".toml (anipose, Pose2Sim, caliscope), extri.yml beside intri.yml (OpenCV, EasyMocap), .qca.txt or .xml (Qualisys)"
)
WRITTEN = {  # layouts that `write_layout` writes, and what the output is
    "anipose": "a .toml file, also of Pose2Sim and of zenocap itself",
    "caliscope": "a .toml file",
    "easymocap": "a .yml file with extri in its name; intri beside it",
    "qualisys": "a .txt or .xml file, such as room.qca.txt; no fisheye lenses, 4 coefficients of distortion",
    "ros": "a folder; a camera_info file of each camera, without positions",
}


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
            case ".xml" if is_storage(path):
                return read_opencv(path, up_axis)
            case ".txt" | ".xml":
                return read_qualisys(path, up_axis)
            case ".yml" | ".yaml":
                if is_ros_info(path):
                    read_ros_info(path)  # errors of the file itself come first
                    raise UserError(
                        f"{path}: camera_info has intrinsics only, no position and orientation; {WITH_POSITION}"
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


def write_layout(path: Path | str, cameras: dict[str, Camera], layout: str, up_axis: str = "y") -> list[Path]:
    """Write cameras of the Y-up world in a layout of WRITTEN; returns the files.  up_axis: of the world in the files.

    Raises UserError, OSError.
    """
    path = Path(path)
    checked_up_axis(path, up_axis)
    match layout:
        case "anipose":
            write_calibration(path, cameras, up_axis)
            return [path]
        case "caliscope":
            files = {_suffixed(path, ".toml", layout): caliscope_text(cameras.values(), up_axis)}
        case "easymocap":
            extrinsics, intrinsics = easymocap_texts(path, cameras.values(), up_axis)
            beside = intrinsics_beside(_suffixed(path, ".yml", layout))
            if beside == path:
                raise UserError(
                    f"{path}: allowed: a name with extri in it, such as extri.yml; intri.yml is written beside it"
                )
            files = {path: extrinsics, beside: intrinsics}
        case "qualisys":
            known = path if path.suffix.lower() == ".xml" else _suffixed(path, ".txt", layout)
            files = {known: qualisys_text(path, cameras.values(), up_axis)}
        case "ros":
            path.mkdir(parents=True, exist_ok=True)
            files = {path / f"{name}.yaml": ros_info_text(Lens.of(camera)) for name, camera in cameras.items()}
        case _:
            raise UserError(f"layout = {layout!r}: allowed: {', '.join(WRITTEN)}")
    for file, text in files.items():
        write_atomically(file, text.encode())
    return list(files)


def _suffixed(path: Path, suffix: str, layout: str) -> Path:
    if path.suffix.lower() != suffix:
        raise UserError(f"{path}: suffix {path.suffix!r}: allowed in the layout {layout}: {suffix}")
    return path
