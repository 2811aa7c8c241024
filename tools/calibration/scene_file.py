"""Files of `zenocap calibrate scene`: known points and their pixels; and the report of what they gave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec

from zenocap.common.camera.lens import Lens
from zenocap.common.camera.scene_calibration import PlacedCamera, placed_camera
from zenocap.common.camera.validation import MAX_DISTANCE_M, Entry, checked_size
from zenocap.common.errors import UserError
from zenocap.common.toml_file import read_toml

GOOD_ERROR_M, GOOD_UNNOTICED_M = 0.02, 0.05  # of a person in the middle, of a good calibration; chosen by hand

T = TypeVar("T")

Point = tuple[float, float, float]
Pixel = tuple[float, float]


@dataclass(frozen=True)
class Scene:
    """size: (width, height) of the images, px; None: that of the lenses.  points: m.  picked: px, by camera and point."""

    path: Path
    size: tuple[int, int] | None
    points: Mapping[str, Point]
    picked: Mapping[str, Mapping[str, Pixel]]


def read_scene(path: Path) -> Scene:
    """Read a TOML file with `size`, a table of points, and a table of pixels for each camera.  Raises UserError."""
    tables = dict(read_toml(path))
    size = None if "size" not in tables else checked_size(Entry(path, ""), tables.pop("size"))
    if "points" not in tables:
        raise Entry(path, "").missing("points", tables)
    points = _table(path, "points", tables.pop("points"), dict[str, Point])
    for name, point in points.items():
        if not all(abs(value) <= MAX_DISTANCE_M for value in point):
            raise Entry(path, "points").error(name, list(point), f"metres, up to {MAX_DISTANCE_M:g}")
    picked = {camera: _table(path, camera, table, dict[str, Pixel]) for camera, table in tables.items()}
    if not picked:
        raise UserError(f"{path}: no camera in it: allowed: a table of pixels for each camera, such as [cam01]")
    for camera, pixels in picked.items():
        for name in pixels:
            if name not in points:
                raise UserError(f"{path}: {camera}.{name}: no such point; there are: {', '.join(points)}")
    return Scene(path, size, points, picked)


def placed_cameras(scene: Scene, lenses: Mapping[str, Lens] | None) -> list[PlacedCamera]:
    """The cameras of a scene; a single lens is that of all cameras.  Raises UserError."""
    placed = []
    for name, pixels in scene.picked.items():
        lens = _lens_of(name, lenses)
        size = scene.size or (lens.size if lens is not None else None)
        if size is None:
            raise UserError(f"{scene.path}: size is missing: allowed: width and height of the images, or --lenses")
        if lens is not None and lens.size != size:
            raise UserError(f"{scene.path}: size = {list(size)}: allowed: that of the lens of {name}, {list(lens.size)}")
        for point, (x, y) in pixels.items():
            if not (-0.5 <= x <= size[0] - 0.5 and -0.5 <= y <= size[1] - 0.5):
                allowed = f"inside the image of {size[0]} x {size[1]} px"
                raise Entry(scene.path, name).error(point, [x, y], allowed)
        placed.append(placed_camera(name, size, scene.points, pixels, lens))
    return placed


def scene_report(placed: PlacedCamera) -> list[str]:
    """Report of a camera's position, residuals and errors, as lines of text."""
    x, y, z = placed.camera.centre
    worst = max(zip(placed.points, placed.residuals_px, strict=True), key=lambda one: float((one[1] ** 2).sum()))
    name, limit_px, error_m = placed.unnoticed
    moved = f"which moves the person by {1000 * error_m:.0f} mm"
    return [
        f"{placed.camera.name}: at ({x:.3f}, {y:.3f}, {z:.3f}) m, focal length {placed.camera.matrix[0, 0]:.1f} px",
        f"  {len(placed.points)} points, {placed.residual_px:.2f} px off; most: {worst[0]} "
        f"({worst[1][0]:+.2f}, {worst[1][1]:+.2f}) px",
        f"  expected error of a person in the middle: {1000 * placed.error_m:.0f} mm",
        f"  no other point checks {name}"
        if limit_px == float("inf")
        else f"  {name} may be {limit_px:.0f} px off without being noticed, {moved}",
    ]


def scene_verdict(cameras: Sequence[PlacedCamera]) -> tuple[str, list[str]]:
    """Verdict on a calibration, good, unchecked or poor, and its reasons, for people."""
    if remarks := [remark for placed in cameras for remark in placed.remarks]:
        return "poor", remarks
    reasons = []
    for placed in cameras:
        name, _, error_m = placed.unnoticed
        if placed.error_m > GOOD_ERROR_M:
            expected = f"the expected error is {1000 * placed.error_m:.0f} mm, more than {1000 * GOOD_ERROR_M:.0f}"
            reasons.append(f"{placed.camera.name}: {expected}: add points, further apart in the image")
        elif error_m > GOOD_UNNOTICED_M:
            reasons.append(f"{placed.camera.name}: an error in {name} would not be noticed: add points near it")
    return ("unchecked" if reasons else "good"), reasons


def _table(path: Path, key: str, value: object, type: type[T]) -> T:
    try:
        return msgspec.convert(value, type)
    except msgspec.ValidationError as error:
        allowed = "name = [x, y, z] in metres" if key == "points" else "point = [column, row] in px"
        raise UserError(f"{path}: {key}: {error}; allowed: {allowed}") from error


def _lens_of(name: str, lenses: Mapping[str, Lens] | None) -> Lens | None:
    if lenses is None:
        return None
    if len(lenses) == 1:
        return next(iter(lenses.values()))
    if name not in lenses:
        raise UserError(
            f"no lens of {name}; there are: {', '.join(lenses)}; allowed: one lens for all, or one for each camera"
        )
    return lenses[name]
