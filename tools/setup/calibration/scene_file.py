"""Files of `zenocap calibrate scene`: known points and their pixels; and the report of what they gave."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import msgspec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.camera.lens import Lens, of_images
from zenocap.common.camera.scene_calibration import PlacedCamera, placed_camera
from zenocap.common.camera.validation import MAX_DISTANCE_M, Entry, checked_size
from zenocap.common.errors import UserError
from zenocap.common.toml_file import quoted, read_toml

GOOD_ERROR_M, GOOD_UNNOTICED_M = 0.02, 0.05  # of a person in the middle, of a good calibration; chosen by hand

SIZE_KEY = "size"  # of a camera's table, where its images have a size of their own; no name of a point
BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")  # of TOML

T = TypeVar("T")

Point = tuple[float, float, float]
Pixel = tuple[float, float]


@dataclass(frozen=True)
class PickedPoints:
    """size: (width, height) of the images, px; None: that of the lenses.  points: m.  picked: px, by camera and point.

    sizes: of cameras whose images have another size than `size`.
    """

    path: Path
    size: tuple[int, int] | None
    points: Mapping[str, Point]
    picked: Mapping[str, Mapping[str, Pixel]]
    sizes: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def size_of(self, camera: str) -> tuple[int, int] | None:
        """Size of a camera's images, px; None: that of its lens."""
        return self.sizes.get(camera, self.size)


def read_scene(path: Path) -> PickedPoints:
    """Read a TOML file with `size`, a table of points, and a table of pixels for each camera.  Raises UserError."""
    tables = dict(read_toml(path))
    size = None if "size" not in tables else checked_size(Entry(path, ""), tables.pop("size"))
    if "points" not in tables:
        raise Entry(path, "").missing("points", tables)
    points = _table(path, "points", tables.pop("points"), dict[str, Point])
    for name, point in points.items():
        if not all(abs(value) <= MAX_DISTANCE_M for value in point):
            raise Entry(path, "points").error(name, list(point), f"metres, up to {MAX_DISTANCE_M:g}")
    sizes: dict[str, tuple[int, int]] = {}
    for camera, table in tables.items():
        if isinstance(table, dict) and SIZE_KEY in table:
            table = tables[camera] = dict(table)
            sizes[camera] = checked_size(Entry(path, camera), table.pop(SIZE_KEY))
    picked = {camera: _table(path, camera, table, dict[str, Pixel]) for camera, table in tables.items()}
    if not picked:
        raise UserError(f"{path}: no camera in it: allowed: a table of pixels for each camera, such as [cam01]")
    for camera, pixels in picked.items():
        for name in pixels:
            if name not in points:
                raise UserError(f"{path}: {camera}.{name}: no such point; there are: {', '.join(points)}")
    return PickedPoints(path, size, points, picked, sizes)


def scene_text(scene: PickedPoints) -> str:
    lines = [
        "# Points of the room, for zenocap calibrate scene: X, Y (height) and Z in m; then their pixels in each camera."
    ]
    if scene.size is not None:
        lines.append(f"size = {list(scene.size)}  # of the images, px")
    lines += ["", "[points]", *(f"{_key(name)} = {_numbers(place)}" for name, place in scene.points.items())]
    for camera, pixels in scene.picked.items():
        own = scene.sizes.get(camera)
        lines += ["", f"[{_key(camera)}]", *([f"{SIZE_KEY} = {list(own)}"] if own is not None else [])]
        lines += [f"{_key(name)} = {_numbers(pixel)}" for name, pixel in pixels.items()]
    return "\n".join(lines) + "\n"


def write_scene(scene: PickedPoints) -> None:
    """Write the file of a scene atomically; comments of an earlier one are lost.  Raises OSError."""
    write_atomically(scene.path, scene_text(scene).encode())


def placed_cameras(scene: PickedPoints, lenses: Mapping[str, Lens] | None) -> list[PlacedCamera]:
    """The cameras of a scene; a single lens is that of all cameras.  Raises UserError."""
    return [placed_in_scene(scene, name, lenses) for name in scene.picked]


def placed_in_scene(scene: PickedPoints, name: str, lenses: Mapping[str, Lens] | None) -> PlacedCamera:
    """A camera of a scene.  Raises UserError."""
    lens, pixels = _lens_of(name, lenses), scene.picked[name]
    size = scene.size_of(name)
    if lens is not None:
        lens = lens if size is None else of_images(lens, size)
        size = size or lens.size
    if size is None:
        raise UserError(f"{scene.path}: size is missing: allowed: width and height of the images, or --lenses")
    if lens is not None and lens.size != size:
        raise UserError(f"{scene.path}: size = {list(size)}: allowed: that of the lens of {name}, {list(lens.size)}")
    for point, (x, y) in pixels.items():
        if not (-0.5 <= x <= size[0] - 0.5 and -0.5 <= y <= size[1] - 0.5):
            allowed = f"inside the image of {size[0]} x {size[1]} px"
            raise Entry(scene.path, name).error(point, [x, y], allowed)
    return placed_camera(name, size, scene.points, pixels, lens)


def scene_report(placed: PlacedCamera) -> list[str]:
    """Report of a camera's position, residuals and errors, as lines of text."""
    x, y, z = placed.camera.centre
    worst = max(zip(placed.points, placed.residuals_px, strict=True), key=lambda one: float((one[1] ** 2).sum()))
    name, limit_px, error_m = placed.unnoticed
    moved = f"which moves the person by {1000 * error_m:.0f} mm"
    largest = int(placed.per_pixel_m.argmax())
    pixel = f"one pixel in {placed.points[largest]} moves it by {1000 * placed.per_pixel_m[largest]:.1f} mm, the most"
    return [
        f"{placed.camera.name}: at ({x:.3f}, {y:.3f}, {z:.3f}) m, focal length {placed.camera.matrix[0, 0]:.1f} px",
        f"  {len(placed.points)} points, {placed.residual_px:.2f} px off; most: {worst[0]} "
        f"({worst[1][0]:+.2f}, {worst[1][1]:+.2f}) px",
        f"  expected error of a person in the middle: {1000 * placed.error_m:.0f} mm; {pixel}",
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


def scene_data(cameras: Sequence[PlacedCamera]) -> dict[str, object]:
    """Verdict and cameras as builtins."""
    word, reasons = scene_verdict(cameras)
    rows = [
        {
            "name": one.camera.name,
            "position_m": one.camera.centre.tolist(),
            "focal_px": float(one.camera.matrix[0, 0]),
            "residuals_px": dict(zip(one.points, one.residuals_px.tolist(), strict=True)),
            "expected_error_m": one.error_m,
            "remarks": list(one.remarks),
        }
        for one in cameras
    ]
    return {"verdict": word, "reasons": reasons, "cameras": rows}


def _key(name: str) -> str:
    return name if BARE_KEY.fullmatch(name) else quoted(name)


def _numbers(values: Sequence[float]) -> str:
    return f"[{', '.join(repr(round(float(value), 4)) for value in values)}]"


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
