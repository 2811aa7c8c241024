"""Measurements files of `zenocap calibrate lines`, and the report of what they gave."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.line_calibration import Measurements, Pinnacles, SolvedCamera
from zenocap.common.camera.line_sensitivity import MAX_UNDETECTED, Sensitivity
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


def write_measurements(path: Path, measured: Measurements) -> None:
    """Write a TOML file of measurements atomically; comments of an earlier one are lost.  Raises OSError."""
    lines = [
        "# For zenocap calibrate lines: equal objects at A = (0, 0), B = (0, d_z), C = (d_x, 0), and their tops.",
        f"size = {list(measured.size)}  # of the images, px",
        f"d_x = {measured.d_x:g}  # m",
        f"d_z = {measured.d_z:g}",
        f"t = {measured.t:g}  # height of the objects, m",
    ]
    for number, its in ((1, measured.camera1), (2, measured.camera2)):
        lines += ["", f"[camera{number}]"]
        lines += [f"{key} = [{x:.2f}, {y:.2f}]" for key, (x, y) in (("a", its.a), ("b", its.b), ("c", its.c))]
        lines += [] if its.distance_m is None else [f"distance = {its.distance_m:g}"]
        lines += [] if its.height_m is None else [f"height = {its.height_m:g}"]
    write_atomically(path, ("\n".join(lines) + "\n").encode())


def solution_report(solved: SolvedCamera, found: Sensitivity) -> list[str]:
    """Report of a camera's position, focal length, residuals and sensitivity, as lines of text."""
    x, y, z = solved.camera.centre
    offs = zip("ABC", solved.residuals_px, strict=True)
    return [
        f"{solved.camera.name}: focal length {solved.focal_px:.1f} px, at ({x:.3f}, {y:.3f}, {z:.3f}) m",
        f"  distance {solved.distance_m:.3f} ± {solved.distance_error_m:.3f} m",
        "  residuals px: " + ", ".join(f"{name}' ({x:+.2f}, {y:+.2f})" for name, (x, y) in offs),
        f"  one pixel in the {found.coordinate} changes the focal length by {found.pixel:.1%}, and with it the place of a "
        f"person 1 m beside the origin by {1000 * found.pixel:.0f} mm",
    ]


def verdict(measured: Measurements, cameras: Sequence[SolvedCamera], found: Sequence[Sensitivity]) -> tuple[str, list[str]]:
    """Verdict on a calibration, good, unchecked or poor, and its reasons, for people.

    poor: measurements contradict each other.  unchecked: nothing contradicts them, but an error of a few pixels would not
    have been noticed and would matter.
    """
    if remarks := [remark for solved in cameras for remark in solved.remarks]:
        return "poor", remarks
    reasons = []
    for number, one in enumerate(found, start=1):
        if not one.checked:
            height_m = (measured.camera1 if number == 1 else measured.camera2).height_m
            advice = f"measure --height{number}" if height_m is None else "check it again in the image"
            reasons.append(
                f"camera {number}: {one.undetected_px:g} px in the {one.undetected_coordinate} would not be noticed and "
                f"change the focal length by {one.undetected:.0%}: {advice}"
            )
    first, second = (solved.focal_px for solved in cameras)
    if reasons and abs(first / second - 1.0) > MAX_UNDETECTED:
        difference = f"the focal lengths differ by {abs(first / second - 1.0):.0%}"
        reasons.append(f"{difference}: with equal cameras and the same zoom, one is wrong")
    return ("unchecked" if reasons else "good"), reasons
