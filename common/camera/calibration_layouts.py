"""The table of layouts of calibration files: which files each has, and what reads and writes it."""

import codecs
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from zenocap.common.camera.opencv_storage import is_storage
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.ros_camera_info import is_ros_info
from zenocap.common.errors import UserError
from zenocap.common.table import Table, attribute


@dataclass(frozen=True)
class CalibrationLayout:
    """One layout.  files: those that it reads, in words, for errors.  suffixes: theirs.

    has: whether a file with such a suffix is of this layout.  Raises OSError.
    read: "module:function", called with file and up axis of its world; returns the cameras by name in the Y-up world,
    metres.  Raises UserError.  "": the layout is only written.
    write: "module:function", called with path, cameras of the Y-up world and up axis of the written one; returns the texts
    by file.  Raises UserError.  "": the layout is only read.  written: suffixes of the path, the usual first; none: all.
    """

    name: str
    files: str = ""
    suffixes: tuple[str, ...] = ()
    has: Callable[[Path], bool] = lambda path: True
    read: str = ""
    write: str = ""
    written: tuple[str, ...] = ()

    def cameras(self, path: Path, up_axis: str) -> dict[str, Camera]:
        """Read a file.  Raises UserError, OSError."""
        return cast("Callable[[Path, str], dict[str, Camera]]", attribute(self.read))(path, up_axis)

    def texts(self, path: Path, cameras: dict[str, Camera], up_axis: str) -> dict[Path, str]:
        """Texts of the files to write.  Raises UserError, OSError."""
        if self.written and path.suffix.lower() not in self.written:
            raise UserError(f"{path}: suffix {path.suffix!r}: allowed in the layout {self.name}: {self.written[0]}")
        write = cast("Callable[[Path, dict[str, Camera], str], dict[Path, str]]", attribute(self.write))
        return write(path, cameras, up_axis)


def _is_xml(path: Path) -> bool:
    with path.open("rb") as file:
        return path.suffix.lower() == ".xml" or b"<" in file.read(256)


HOME = "zenocap.common.camera"
ANIPOSE = CalibrationLayout(
    "anipose", ".toml (anipose, Pose2Sim, caliscope)", (".toml",), read=f"{HOME}.anipose:read_anipose",
    write=f"{HOME}.anipose:anipose_texts",
)  # fmt: skip
CALISCOPE = CalibrationLayout("caliscope", write=f"{HOME}.caliscope:caliscope_texts", written=(".toml",))
EASYMOCAP = CalibrationLayout(
    "easymocap", "extri.yml beside intri.yml (OpenCV, EasyMocap)", (".yml", ".yaml", ".xml"), is_storage,
    f"{HOME}.opencv_storage:read_opencv", f"{HOME}.opencv_storage:easymocap_texts", (".yml",),
)  # fmt: skip
QUALISYS = CalibrationLayout(
    "qualisys", ".qca.txt or .xml (Qualisys)", (".txt", ".xml"), _is_xml, f"{HOME}.qualisys:read_qualisys",
    f"{HOME}.qualisys:qualisys_texts", (".txt", ".xml"),
)  # fmt: skip
ROS = CalibrationLayout(
    "ros", "", (".yml", ".yaml"), is_ros_info, f"{HOME}.ros_camera_info:no_cameras", f"{HOME}.ros_camera_info:ros_texts"
)

LAYOUTS = Table(
    CalibrationLayout,
    "zenocap.calibrations",
    {name: f"{__name__}:{name.upper()}" for name in ("anipose", "caliscope", "easymocap", "qualisys", "ros")},
)

NAMED_BYTES = 16_384  # of a file, in which its kind is looked for
FOREIGN = {
    "Kalibr's camchain, without the floor": re.compile(rb"^cam0:\s*\n(?:[ \t]+.*\n)*?[ \t]+camera_model:", re.MULTILINE),
    "calib.io's JSON": re.compile(rb'^\s*\{.*"(?:polymorphic_name|polymorphic_id|Calibration)"', re.DOTALL),
    "COLMAP's cameras.txt, without places": re.compile(rb"^# Camera list with|^\d+ [A-Z_]+ \d+ \d+ [\d.]+ [\d.]+"),
    "the cameras of Agisoft Metashape": re.compile(rb"<document[^>]*>\s*<chunk\b"),
    "Vicon's .xcp": re.compile(rb"<Cameras[\s>].*<Camera\s[^>]*(?:DEVICEID|SENSOR_SIZE|USERID)", re.DOTALL),
}


def foreign_name(path: Path) -> str:
    """What a file is that no layout reads, in words; empty where that is not known.  Raises OSError."""
    with path.open("rb") as file:
        begin = file.read(NAMED_BYTES).removeprefix(codecs.BOM_UTF8)
    return next((name for name, pattern in FOREIGN.items() if pattern.search(begin)), "")


def layout_of(path: Path) -> CalibrationLayout:
    """Layout of a file that exists.  Raises UserError for a suffix or content that no layout reads, OSError."""

    def fits(layout: CalibrationLayout) -> bool:
        return path.suffix.lower() in layout.suffixes and layout.has(path)

    if name := foreign_name(path):  # only a package may read it
        for key in LAYOUTS.names():
            if key not in LAYOUTS.own and fits(LAYOUTS.row(key)):
                return LAYOUTS.row(key)
        raise UserError(f"{path}: is {name}, which is not read: allowed: {readable()}")
    found = LAYOUTS.first(fits) or LAYOUTS.first(lambda one: path.suffix.lower() in one.suffixes)
    if found is None:
        raise UserError(f"{path}: suffix {path.suffix!r}: allowed: {readable()}")
    return found


def readable() -> str:
    """The files that can be read, in words."""
    return ", ".join(one.files for one in LAYOUTS.rows().values() if one.files)


def writable() -> tuple[str, ...]:
    """Names of the layouts that can be written."""
    return tuple(name for name, one in LAYOUTS.rows().items() if one.write)
