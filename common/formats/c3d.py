"""C3D export of joint centres as points, for Visual3D, Mokka, MotionBuilder and biomechanics toolkits."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import ezc3d
import numpy as np

from zenocap.common.atomic_write import atomic_file
from zenocap.common.body.joint_conventions import SPINE, TITLES, origin_of, points_of
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.trajectories import Axes, Trajectories, Unit, axis_directions, convert

BYTES_PER_POINT = 16
MAX_FRAMES = 65_535  # the header counts frames in 16 bits
MAX_TEXTS = 255  # of a parameter, whose sizes have 8 bits; the rest is in LABELS2, LABELS3 ...


def write_c3d(
    path: Path,
    data: Trajectories,
    *,
    axes: Axes = "y-up",
    unit: Unit = "mm",
    descriptions: Sequence[str] = (),
    smoothing: str = "none",
    sizes: str = "",
) -> None:
    """Write one row per frame; `data` has consecutive frames (`every_frame`).  Missing points have residual -1.

    descriptions: of the points; "joint centre NAME" if empty.  smoothing: what was done, for ZENOCAP:SMOOTHING.
    sizes: origin of the body's sizes, for ZENOCAP:BODY, where it is to be stated.
    C3D counts frames from 1: frame k is written as k + 1, so that frame 0 has index 0.
    Raises OSError, and UserError for frame numbers above C3D's limit.
    """
    first, count = int(data.frames[0]), len(data.frames)
    if first + count > MAX_FRAMES:
        last = first + count - 1
        raise UserError(f"{path}: last frame {last}: allowed in C3D: up to {MAX_FRAMES - 1}; take a part with --until")
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [data.rate]
    point["UNITS"]["value"] = [unit]
    texts = list(descriptions) or [f"joint centre {name}" for name in data.names]
    for key, values in (("LABELS", list(data.names)), ("DESCRIPTIONS", texts)):
        point[key]["value"] = values[:MAX_TEXTS]
        for number, start in enumerate(range(MAX_TEXTS, len(values), MAX_TEXTS), 2):
            file.add_parameter("POINT", f"{key}{number}", values[start : start + MAX_TEXTS])
    file["header"]["points"]["first_frame"] = first  # ezc3d adds the 1
    up = axis_directions(axes).index("up")
    file.add_parameter("POINT", "X_SCREEN", "+X")
    file.add_parameter("POINT", "Y_SCREEN", f"+{'XYZ'[up]}")
    file.add_parameter("MANUFACTURER", "COMPANY", "zenocap")
    file.add_parameter("MANUFACTURER", "SOFTWARE", "zenocap")
    file.add_parameter("MANUFACTURER", "VERSION_LABEL", version("zenocap"))
    if smoothing != "none":
        file.add_parameter("ZENOCAP", "SMOOTHING", smoothing)
    if sizes:
        file.add_parameter("ZENOCAP", "BODY", sizes)
    points = np.ones((4, len(data.names), count))
    points[:3] = convert(data.points, axes, unit).transpose(2, 1, 0)
    missing = np.isnan(points[:3]).any(axis=0)
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = np.where(missing, -1.0, 0.0)[None]
    with atomic_file(path) as unfinished:
        named = unfinished.with_name(f"{unfinished.name}.c3d")  # ezc3d requires the suffix
        try:
            file.write(str(named))
            if named.stat().st_size < BYTES_PER_POINT * len(data.names) * count:
                raise OSError(None, "the file was written incompletely")  # ezc3d reports no error
            named.replace(unfinished)
        finally:
            named.unlink(missing_ok=True)


def export(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`."""
    write_c3d(
        path, request.points(), axes=request.axes, unit=request.unit, descriptions=_descriptions(request),
        smoothing=request.smoothing, sizes="" if request.measured else request.sizes,
    )  # fmt: skip


def _descriptions(request: ExportRequest) -> list[str]:
    """Of every point: its convention, and whether it is measured; empty for the default of `write_c3d`."""
    if request.joints == "zenocap" and not request.spine:
        return []
    title, anatomy = TITLES[request.joints], request.track.anatomy
    points = points_of(request.joints, anatomy, spine=request.spine)
    return [f"{'spine' if p in SPINE else title} {p.name}, {origin_of(p, anatomy)}" for p in points]
