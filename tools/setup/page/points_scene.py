"""Points of the room that are placed in pictures: each camera on its own, see `scene_calibration`."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.scene_calibration import FEWEST, FEWEST_WITHOUT_LENS, PlacedCamera
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.scene_file import (
    SIZE_KEY,
    PickedPoints,
    placed_in_scene,
    read_scene,
    scene_report,
    scene_verdict,
    write_scene,
)
from zenocap.tools.setup.page.point_messages import FieldRow, PlacedView, PointTask
from zenocap.tools.setup.page.points_task import Placed, Solution, next_sentence, refused

Point = tuple[float, float, float]
RESERVED = (SIZE_KEY, "points")  # tables and keys of the file


class ScenePointTask:
    """points_file: of the scene, read when it exists, written by the page.  Raises UserError for a wrong one."""

    name: PointTask = "scene"
    editable = True
    centre_lines = False

    def __init__(
        self, cameras: Sequence[str], points_file: Path, output: Path, lenses: Mapping[str, Lens] | None = None,
        force: bool = False,
    ) -> None:  # fmt: skip
        """force: whether a file at `output` that is not the page's is replaced."""
        if wrong := [name for name in cameras if name in RESERVED]:
            raise UserError(f"camera {wrong[0]}: allowed: any name but {' and '.join(RESERVED)}")
        self._names, self._path, self._output, self._lenses = tuple(cameras), points_file, output, lenses
        self._new = not force
        self._scene = read_scene(points_file) if points_file.exists() else PickedPoints(points_file, None, {}, {})
        if self._scene.picked and not any(name in self._scene.picked for name in cameras):
            there = ", ".join(self._scene.picked)
            raise UserError(f"{points_file}: no points of {', '.join(cameras)}; there are those of: {there}")
        self._solved: dict[str, tuple[object, PlacedCamera | UserError]] = {}

    def start(self) -> Placed:
        picks = {name: dict(self._scene.picked.get(name, {})) for name in self._names}
        known = {name: self._scene.size_of(name) for name in self._names if picks[name]}
        sizes = {name: size for name, size in known.items() if size is not None}
        return Placed(dict(self._scene.points), {}, picks, {}, sizes)

    def completed(self, placed: Placed) -> Placed:
        return placed

    def fields(self, placed: Placed) -> list[FieldRow]:
        return []

    def solve(self, placed: Placed) -> Solution:
        known: dict[str, Point] = {}
        for name, (x, y, z) in placed.points.items():
            if x is not None and y is not None and z is not None:
                known[name] = (x, y, z)
        found = {name: self._placed(name, known, placed) for name in self._names}
        solved = [one for one in found.values() if isinstance(one, PlacedCamera)]
        views = [_view(name, one, known, placed) for name, one in found.items()]
        verdict, reasons = "", [view.problem for view in views if view.problem]
        if len(solved) == len(found):
            verdict, reasons = scene_verdict(solved)
        report = [line for one in solved for line in scene_report(one)]
        cameras = {one.camera.name: one.camera for one in solved}
        return Solution(views, verdict, reasons, cameras, report, self._sentence(known, views, verdict, reasons))

    def write(self, placed: Placed, solution: Solution) -> list[str]:
        open_points = [name for name, place in placed.points.items() if None in place]
        if open_points:
            raise refused([f"{', '.join(open_points)}: coordinates are missing: type them, or remove the point"])
        if wrong := [view.problem for view in solution.views if view.problem]:
            raise refused(wrong)
        sizes = {name: placed.picked_sizes.get(name) or placed.sizes[name] for name in self._names}
        common = next(iter(sizes.values()))
        others = {name: pixels for name, pixels in self._scene.picked.items() if name not in self._names}
        other_sizes = {name: size for name in others if (size := self._scene.size_of(name)) is not None}
        own = {name: size for name, size in (sizes | other_sizes).items() if size != common}
        kept = {camera: {k: v for k, v in one.items() if k in placed.points} for camera, one in others.items()}
        points = {name: (float(x or 0.0), float(y or 0.0), float(z or 0.0)) for name, (x, y, z) in placed.points.items()}
        scene = PickedPoints(self._path, common, points, {**placed.picks, **kept}, own)
        try:
            write_scene(scene)
            write_calibration(self._output, dict(solution.cameras), new=self._new)
            self._new = False
        except FileExistsError as error:
            raise UserError(f"{self._output}: exists since a moment ago: allowed: move it away, and save again") from error
        except OSError as error:
            raise UserError(f"{error.filename or self._output}: cannot be written: {error.strerror}") from error
        return [str(self._path), str(self._output)]

    def _placed(self, name: str, known: Mapping[str, Point], placed: Placed) -> PlacedCamera | UserError:
        """The camera, solved again only where something changed."""
        if problem := placed.size_problem(name):
            return UserError(problem)
        pixels = {point: pixel for point, pixel in placed.picks.get(name, {}).items() if point in known}
        size = placed.sizes.get(name) or placed.picked_sizes.get(name)
        if size is None:
            return UserError(f"{name}: no picture yet")
        key = tuple((point, known[point], pixel) for point, pixel in pixels.items()), size
        if name not in self._solved or self._solved[name][0] != key:
            scene = PickedPoints(self._path, size, known, {name: pixels})
            try:
                self._solved[name] = key, placed_in_scene(scene, name, self._lenses)
            except UserError as error:
                self._solved[name] = key, error
        return self._solved[name][1]

    def _sentence(
        self, known: Mapping[str, Point], views: Sequence[PlacedView], verdict: str, reasons: Sequence[str]
    ) -> str:
        fewest = FEWEST_WITHOUT_LENS if self._lenses is None else FEWEST
        heights = " at different heights" if self._lenses is None else ""
        if len(known) < fewest:
            return f"Add {fewest} or more points of the room{heights}, and type where they are: {len(known)} so far."
        for view in views:
            placed = sum(point in known for point in view.picks)
            if view.size is not None and placed < fewest:
                return f"Place {fewest - placed} more points in the picture of {view.name}: click where each is."
        return next_sentence(verdict, reasons)


def _view(name: str, one: PlacedCamera | UserError, known: Mapping[str, Point], placed: Placed) -> PlacedView:
    size, picks = placed.sizes.get(name), dict(placed.picks.get(name, {}))
    if isinstance(one, UserError):
        return PlacedView(name=name, size=size, picks=picks, problem=str(one))
    off_px = {point: float(np.hypot(*off)) for point, off in zip(one.points, one.residuals_px, strict=True)}
    return PlacedView(
        name=name,
        size=size,
        picks=picks,
        expected=_expected(one, known, picks),
        off_px=off_px,
        mm_per_px={point: 1e3 * float(m) for point, m in zip(one.points, one.per_pixel_m, strict=True)},
        suspect=one.suspect[0] if one.suspect is not None else "",
        lines=scene_report(one),
    )


def _expected(
    one: PlacedCamera, known: Mapping[str, Point], picks: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Where the camera sees all points, px of its image as it is."""
    found = {}
    for point, (x, y) in zip(one.points, one.residuals_px, strict=True):
        found[point] = (picks[point][0] - float(x), picks[point][1] - float(y))
    camera, (width, height) = one.camera, one.camera.size
    for point, place in known.items():
        if point in found or camera.fisheye is not None:  # its pixels would be those of the rectified image
            continue
        world = np.array([place])
        if (world @ camera.rotation.T + camera.translation)[0, 2] > 0.1:
            column, row = camera.project(world)[0]
            if -0.5 <= column <= width - 0.5 and -0.5 <= row <= height - 0.5:
                found[point] = float(column), float(row)
    return found
