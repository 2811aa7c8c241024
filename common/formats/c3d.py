"""C3D, as Visual3D, Mokka, MotionBuilder and the biomechanics toolkits read it: joint centres as points."""

from importlib.metadata import version
from pathlib import Path

import ezc3d
import numpy as np

from common.formats.axes import Axes, Unit, directions, turned
from common.formats.trc import FormatError, Trajectories
from common.formats.whole import whole_file

BYTES_PER_POINT = 16
MAX_FRAMES = 65_535  # the header counts frames in 16 bits


def write_c3d(path: Path, data: Trajectories, *, axes: Axes = "y-up", unit: Unit = "mm") -> None:
    """One row per frame, without holes between (`every_frame`); a missing point has residual -1.

    C3D counts frames from 1: our frame k is its frame k + 1, so that a file which begins at frame 0 has it at index 0.
    Raises OSError, and FormatError for frames that a C3D file cannot count.
    """
    first, count = int(data.frames[0]), len(data.frames)
    if first + count > MAX_FRAMES:
        last = first + count - 1
        raise FormatError(f"{path}: last frame {last}: allowed in C3D: up to {MAX_FRAMES - 1}; take a part with --until")
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [data.rate]
    point["UNITS"]["value"] = [unit]
    point["LABELS"]["value"] = list(data.names)
    point["DESCRIPTIONS"]["value"] = [f"joint centre {name}" for name in data.names]
    file["header"]["points"]["first_frame"] = first  # ezc3d adds the 1
    up = directions(axes).index("up")
    file.add_parameter("POINT", "X_SCREEN", "+X")
    file.add_parameter("POINT", "Y_SCREEN", f"+{'XYZ'[up]}")
    file.add_parameter("MANUFACTURER", "COMPANY", "zenocap")
    file.add_parameter("MANUFACTURER", "SOFTWARE", "zenocap")
    file.add_parameter("MANUFACTURER", "VERSION_LABEL", version("zenocap"))
    points = np.ones((4, len(data.names), count))
    points[:3] = turned(data.points, axes, unit).transpose(2, 1, 0)
    missing = np.isnan(points[:3]).any(axis=0)
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = np.where(missing, -1.0, 0.0)[None]
    with whole_file(path) as unfinished:
        named = unfinished.with_name(f"{unfinished.name}.c3d")  # ezc3d insists on the suffix
        try:
            file.write(str(named))
            if named.stat().st_size < BYTES_PER_POINT * len(data.names) * count:
                raise OSError(None, "the disk took only a part")  # ezc3d says nothing
            named.replace(unfinished)
        finally:
            named.unlink(missing_ok=True)
