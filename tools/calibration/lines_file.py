"""Measurements files of `zenocap calibrate lines`, and the report of what they gave."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from zenocap.common.camera.line_calibration import Measurements, Pinnacles, SolvedCamera
from zenocap.common.errors import UserError
from zenocap.common.toml_file import read_toml

Pair = tuple[float, float]


class _CameraTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    a: Pair
    b: Pair
    c: Pair
    distance: float | None = None
    height: float | None = None


class _MeasurementsFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    size: tuple[int, int]
    d_x: float
    d_z: float
    t: float
    camera1: _CameraTable
    camera2: _CameraTable


def read_measurements(path: Path) -> Measurements:
    """Read a TOML file of measurements.  Raises UserError."""
    try:
        content = msgspec.convert(read_toml(path), _MeasurementsFile)
    except msgspec.ValidationError as error:
        allowed = "size, d_x, d_z, t, camera1, camera2 with a, b, c, distance, height"
        raise UserError(f"{path}: {error}; allowed: {allowed}") from error
    one, two = (Pinnacles(c.a, c.b, c.c, c.distance, c.height) for c in (content.camera1, content.camera2))
    return Measurements(content.size, content.d_x, content.d_z, content.t, one, two)


def solution_report(cameras: Sequence[SolvedCamera]) -> list[str]:
    """Report of each solved camera's position, focal length and residuals, as lines of text."""
    lines = []
    for solved in cameras:
        x, y, z = solved.camera.centre
        offs = zip("ABC", solved.residuals_px, strict=True)
        lines += [
            f"{solved.camera.name}: focal length {solved.focal_px:.1f} px, at ({x:.3f}, {y:.3f}, {z:.3f}) m",
            f"  distance {solved.distance_m:.3f} ± {solved.distance_error_m:.3f} m",
            "  residuals px: " + ", ".join(f"{name}' ({x:+.2f}, {y:+.2f})" for name, (x, y) in offs),
        ]
    return lines
