"""OpenSim storage files (.sto) of joint centres: `zenocap export walk.mcap -o walk.sto`."""

from pathlib import Path

import numpy as np

from zenocap.common.formats.export_format import ExportFormat, ExportRequest
from zenocap.common.formats.trajectories import convert


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


STO = ExportFormat("sto", "zenocap_sto:write", (".sto",), axes=("y-up", "opensim"), points=True, confidence=True)
