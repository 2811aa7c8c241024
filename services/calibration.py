"""Calibrating by markers, and what a calibration file says: from measurements to cameras, and cameras in words."""

import tomllib
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import msgspec

from common.camera.lines import LinesError, Measurements, Pinnacles, SolvedCamera
from common.camera.pairs import angle_between_deg, attitude, most_orthogonal_pair
from common.camera.pinhole import Camera

NEARLY_ORTHOGONAL_DEG = 20.0

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
    """A TOML file of measurements.  Raises LinesError."""
    try:
        content = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), _MeasurementsFile)
    except OSError as error:
        raise LinesError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise LinesError(f"{path}: not TOML: {error}") from error
    except msgspec.ValidationError as error:
        allowed = "size, d_x, d_z, t, camera1, camera2 with a, b, c, distance, height"
        raise LinesError(f"{path}: {error}; allowed: {allowed}") from error
    one, two = (Pinnacles(c.a, c.b, c.c, c.distance, c.height) for c in (content.camera1, content.camera2))
    return Measurements(content.size, content.d_x, content.d_z, content.t, one, two)


def words_of_solved(cameras: Sequence[SolvedCamera]) -> list[str]:
    """Lines that say where each camera stands and how well it explains the measurements."""
    said = []
    for solved in cameras:
        x, y, z = solved.camera.centre
        offs = zip("ABC", solved.residuals_px, strict=True)
        said += [
            f"{solved.camera.name}: focal length {solved.focal_px:.1f} px, at ({x:.3f}, {y:.3f}, {z:.3f}) m",
            f"  distance {solved.distance_m:.3f} ± {solved.distance_error_m:.3f} m",
            "  residuals px: " + ", ".join(f"{name}' ({x:+.2f}, {y:+.2f})" for name, (x, y) in offs),
        ]
    return said


def words_of_cameras(cameras: dict[str, Camera]) -> list[str]:
    """Lines that say where each camera stands, how it looks, and which two suit the method of two views best."""
    said = []
    for name, camera in cameras.items():
        stands = attitude(camera)
        x, y, z = camera.centre
        heading = f"heading {stands.heading_deg:.1f} degrees from -Z towards +X"
        said += [
            f"{name}: {camera.size[0]} x {camera.size[1]} px, focal length {_focal(camera)} px",
            f"  at ({x:.3f}, {y:.3f}, {z:.3f}) m, Y up",
            f"  {heading}, tilt {stands.tilt_deg:+.1f}, roll {stands.roll_deg:+.1f}",
        ]
        if y <= 0:
            said.append("  below the ground: is the up axis right (--up-axis z)?")
    for one, other in combinations(cameras, 2):
        said.append(f"{one} and {other}: {angle_between_deg(cameras[one], cameras[other]):.1f} degrees apart")
    if len(cameras) > 1:
        pair = most_orthogonal_pair(cameras)
        angle = angle_between_deg(*(cameras[name] for name in pair))
        said.append(f"most nearly orthogonal: {pair[0]} (front) and {pair[1]}, {angle:.1f} degrees apart")
        if abs(angle - 90) > NEARLY_ORTHOGONAL_DEG:
            said.append("  far from 90 degrees: method two-view will suffer; hybrid takes any angle")
    return said


def data_of_cameras(cameras: dict[str, Camera]) -> dict[str, object]:
    """The same for programs."""
    entries = []
    for name, camera in cameras.items():
        stands = attitude(camera)
        entries.append(
            {
                "name": name,
                "size_px": list(camera.size),
                "position_m": camera.centre.tolist(),
                "focal_px": [float(camera.matrix[0, 0]), float(camera.matrix[1, 1])],
                "heading_deg": stands.heading_deg,
                "tilt_deg": stands.tilt_deg,
                "roll_deg": stands.roll_deg,
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
