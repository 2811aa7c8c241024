"""OpenSim storage files (.sto) of joint centres, for `zenocap export` and `evaluate`."""

from pathlib import Path

import numpy as np

from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import ExportFormat, ExportRequest
from zenocap.common.formats.import_format import ImportFormat
from zenocap.common.formats.joint_map import UPS, JointMap
from zenocap.common.formats.marker_sets import named_centres
from zenocap.common.formats.trajectories import Trajectories, convert


def write(path: Path, request: ExportRequest) -> None:
    """One row for each frame with a pose: time (s), and x, y and z of each point."""
    points = request.points()
    values = convert(points.points, request.axes, request.unit)
    lines = [path.stem, "DataType=Vec3", "version=3", "endheader", "\t".join(["time", *points.names])]
    for time_s, row in zip(points.times_s, values, strict=True):
        if not np.isnan(row).all():
            cells = (",".join(f"{value:.6f}" for value in point) for point in row)
            lines.append("\t".join([f"{time_s:.6f}", *cells]))
    path.write_text("\n".join([*lines, ""]), encoding="ascii")


def read(path: Path, joints: JointMap | None) -> Trajectories:
    """Joint centres of a file whose rows have equal intervals.  Raises UserError."""
    try:
        head, _, body = path.read_text(encoding="ascii").partition("endheader\n")
        names, *rows = (line.split("\t") for line in body.splitlines())
        times_s = np.array([float(row[0]) for row in rows])
        points = np.array([[[float(value) for value in cell.split(",")] for cell in row[1:]] for row in rows])
        period_s = float(np.diff(times_s).min())
        found = Trajectories(
            tuple(names[1:]), np.rint(times_s / period_s).astype(np.int64), times_s, points, 1.0 / period_s
        )
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise UserError(f"{path}: allowed: a storage file of points with two rows or more: {error}") from error
    if "DataType=Vec3" not in head.splitlines() or points.shape != (len(rows), len(names) - 1, 3):
        raise UserError(f"{path}: allowed: DataType=Vec3, and three coordinates of each point in each row")
    return named_centres(found, path, UPS.index("y"), joints)


STO = ExportFormat("sto", "zenocap_sto:write", (".sto",), axes=("y-up", "opensim"), points=True, confidence=True)
STO_IMPORT = ImportFormat("sto", (".sto",), "zenocap_sto:read")
