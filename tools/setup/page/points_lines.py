"""Three objects placed in the pictures of two cameras: the paper's calibration.  [Two-view 4.1]"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.line_calibration import Measurements, Pinnacles, SolvedCamera, check_measurements, solved_camera
from zenocap.common.camera.line_sensitivity import Sensitivity, pixel_effects, sensitivity
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.lines_file import read_measurements, solution_report, verdict, write_measurements
from zenocap.tools.setup.page.point_messages import FieldRow, PlacedView, PointTask
from zenocap.tools.setup.page.points_task import Place, Placed, Solution, next_sentence, refused

OBJECTS = ("A", "B", "C")
FIELDS = (  # key, name, needed
    ("d_x", "C on the X axis", True),
    ("d_z", "B on the Z axis", True),
    ("t", "height of the objects", True),
    ("distance1", "camera 1 to A, along Z", False),
    ("height1", "height of camera 1", False),
    ("distance2", "camera 2 to A, along X", False),
    ("height2", "height of camera 2", False),
)
TIPS = "the tops of the objects at A, B and C"


class LinePoints:
    """cameras: camera 1, which stands on +Z, and camera 2, on -X.  Raises UserError for others, and for a wrong file."""

    name: PointTask = "lines"
    editable = False
    centre_lines = True

    def __init__(self, cameras: Sequence[str], measurements_file: Path, output: Path, force: bool = False) -> None:
        """force: whether a file at `output` that is not the page's is replaced."""
        if len(cameras) != 2:
            raise UserError(f"{len(cameras)} cameras: allowed: two, camera 1 on +Z that looks to -Z, camera 2 on -X")
        self._names, self._path, self._output = (cameras[0], cameras[1]), measurements_file, output
        self._new = not force
        self._read = read_measurements(measurements_file) if measurements_file.exists() else None

    def start(self) -> Placed:
        names = [key for key, _, _ in FIELDS]
        if self._read is None:
            return self.completed(Placed({}, dict.fromkeys(names), {name: {} for name in self._names}))
        one, two = self._read.camera1, self._read.camera2
        values = (self._read.d_x, self._read.d_z, self._read.t, one.distance_m, one.height_m, two.distance_m, two.height_m)
        picks = {
            name: dict(zip(OBJECTS, (its.a, its.b, its.c), strict=True))
            for name, its in zip(self._names, (one, two), strict=True)
        }
        sizes = dict.fromkeys(self._names, self._read.size)
        return self.completed(Placed({}, dict(zip(names, values, strict=True)), picks, {}, sizes))

    def completed(self, placed: Placed) -> Placed:
        d_x, d_z, t = (placed.fields.get(key) for key in ("d_x", "d_z", "t"))
        places: dict[str, Place] = {"A": (0.0, t, 0.0), "B": (0.0, t, d_z), "C": (d_x, t, 0.0)}
        return replace(placed, points=places)

    def fields(self, placed: Placed) -> list[FieldRow]:
        return [FieldRow(key, name, "m", placed.fields.get(key), needed) for key, name, needed in FIELDS]

    def solve(self, placed: Placed) -> Solution:
        found: list[tuple[Measurements, SolvedCamera, Sensitivity] | UserError] = []
        for number in (1, 2):
            try:
                measured = self._measured(placed, number)
                solved = solved_camera(measured, number, self._names[number - 1])
                found.append((measured, solved, sensitivity(measured, number, solved)))
            except UserError as error:
                found.append(error)
        views = [self._view(number, found[number - 1], placed) for number in (1, 2)]
        word, reasons = "", [view.problem for view in views if view.problem]
        one, two = found
        cameras, report = {}, []
        for each in found:
            if not isinstance(each, UserError):
                cameras[each[1].camera.name] = each[1].camera
                report += solution_report(each[1], each[2])
        if not isinstance(one, UserError) and not isinstance(two, UserError):
            both = replace(one[0], camera2=two[0].camera2)
            word, reasons = verdict(both, (one[1], two[1]), (one[2], two[2]))
        return Solution(views, word, reasons, cameras, report, next_sentence(word, reasons))

    def write(self, placed: Placed, solution: Solution) -> list[str]:
        if wrong := [view.problem for view in solution.views if view.problem]:
            raise refused(wrong)
        both = replace(self._measured(placed, 1), camera2=self._measured(placed, 2).camera2)
        try:
            write_measurements(self._path, both)
            write_calibration(self._output, dict(solution.cameras), new=self._new)
            self._new = False
        except FileExistsError as error:
            raise UserError(f"{self._output}: exists since a moment ago: allowed: move it away, and save again") from error
        except OSError as error:
            raise UserError(f"{error.filename or self._output}: cannot be written: {error.strerror}") from error
        return [str(self._path), str(self._output)]

    def _measured(self, placed: Placed, number: int) -> Measurements:
        """Measurements with those of one camera; the other has the same.  Raises UserError for what is missing."""
        name, picks = self._names[number - 1], placed.picks.get(self._names[number - 1], {})
        sizes = [size for one in self._names if (size := placed.sizes.get(one) or placed.picked_sizes.get(one))]
        missing = [text for key, text, needed in FIELDS if needed and placed.fields.get(key) is None]
        if missing:
            raise UserError(f"type the {', the '.join(missing)}")
        if open_points := [one for one in OBJECTS if one not in picks]:
            raise UserError(f"{name}: place {', '.join(open_points)}: {TIPS}")
        if problem := placed.size_problem(name):
            raise UserError(problem)
        if len(set(sizes)) > 1:
            (one, two) = sizes
            raise UserError(f"pictures of {one[0]} x {one[1]} and {two[0]} x {two[1]} px: allowed: equal sizes")
        values = placed.fields
        d_x, d_z, t = (float(values[key] or 0.0) for key in ("d_x", "d_z", "t"))
        own = Pinnacles(picks["A"], picks["B"], picks["C"], values.get(f"distance{number}"), values.get(f"height{number}"))
        measured = Measurements(sizes[0], d_x, d_z, t, own, own)
        check_measurements(measured)
        return measured

    def _view(
        self, number: int, one: tuple[Measurements, SolvedCamera, Sensitivity] | UserError, placed: Placed
    ) -> PlacedView:
        name = self._names[number - 1]
        size, picks = placed.sizes.get(name), dict(placed.picks.get(name, {}))
        if isinstance(one, UserError):
            return PlacedView(name=name, size=size, picks=picks, problem=str(one))
        measured, solved, found = one
        offs = dict(zip(OBJECTS, solved.residuals_px, strict=True))
        expected = {key: (picks[key][0] - float(x), picks[key][1] - float(y)) for key, (x, y) in offs.items()}
        return PlacedView(
            name=name,
            size=size,
            picks=picks,
            expected=expected,
            off_px={key: float(np.hypot(*off)) for key, off in offs.items()},
            mm_per_px={key: 1e3 * effect for key, effect in pixel_effects(measured, number, solved).items()},
            lines=[*solution_report(solved, found), *(f"  {remark}" for remark in solved.remarks)],
        )
