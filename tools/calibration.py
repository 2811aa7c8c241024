"""Measurements files of `zenocap calibrate lines`, and reports about cameras as text and JSON."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import msgspec

from zenocap.common.camera.line_calibration import Measurements, Pinnacles, SolvedCamera
from zenocap.common.camera.pinhole import Camera, angle_between_deg, attitude, most_orthogonal_pair
from zenocap.common.errors import UserError
from zenocap.common.toml_file import read_toml

NEARLY_ORTHOGONAL_DEG = 20.0  # deviation from 90° above which method two-view is discouraged; chosen by hand

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


def camera_report(cameras: dict[str, Camera]) -> list[str]:
    """Report of each camera's position and attitude and of the most orthogonal pair, as lines of text."""
    lines = []
    for name, camera in cameras.items():
        camera_attitude = attitude(camera)
        x, y, z = camera.centre
        heading = f"heading {camera_attitude.heading_deg:.1f} degrees from -Z towards +X"
        lines += [
            f"{name}: {camera.size[0]} x {camera.size[1]} px, focal length {_focal(camera)} px",
            f"  at ({x:.3f}, {y:.3f}, {z:.3f}) m, Y up",
            f"  {heading}, tilt {camera_attitude.tilt_deg:+.1f}, roll {camera_attitude.roll_deg:+.1f}",
        ]
        if y <= 0:
            lines.append("  below the ground: is the up axis right (--up-axis z)?")
    for one, other in combinations(cameras, 2):
        lines.append(f"{one} and {other}: {angle_between_deg(cameras[one], cameras[other]):.1f} degrees apart")
    if len(cameras) > 1:
        pair = most_orthogonal_pair(cameras)
        angle = angle_between_deg(*(cameras[name] for name in pair))
        lines.append(f"most nearly orthogonal: {pair[0]} (front) and {pair[1]}, {angle:.1f} degrees apart")
        if abs(angle - 90) > NEARLY_ORTHOGONAL_DEG:
            lines.append("  far from 90 degrees: method two-view loses accuracy; hybrid works at any angle")
    return lines


def camera_data(cameras: dict[str, Camera]) -> dict[str, object]:
    """The content of `camera_report` for JSON."""
    entries = []
    for name, camera in cameras.items():
        camera_attitude = attitude(camera)
        entries.append(
            {
                "name": name,
                "size_px": list(camera.size),
                "position_m": camera.centre.tolist(),
                "focal_px": [float(camera.matrix[0, 0]), float(camera.matrix[1, 1])],
                "heading_deg": camera_attitude.heading_deg,
                "tilt_deg": camera_attitude.tilt_deg,
                "roll_deg": camera_attitude.roll_deg,
            }
        )
    angles = [
        {"cameras": [one, other], "angle_deg": angle_between_deg(cameras[one], cameras[other])}
        for one, other in combinations(cameras, 2)
    ]
    pair = list(most_orthogonal_pair(cameras)) if len(cameras) > 1 else None
    return {"cameras": entries, "angles": angles, "most_orthogonal": pair}


def _focal(camera: Camera) -> str:
    fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
    return f"{fx:.1f}" if abs(fx - fy) < 0.05 else f"{fx:.1f} x {fy:.1f}"
