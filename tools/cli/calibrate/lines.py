"""Command calibrate lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn, cast

import typer

from zenocap.tools.cli.calibrate.output import CalibrationOption, ForceOption, check_new, show, write_result
from zenocap.tools.cli.calibrate.points_page import FileAndCameras, LiveOption, file_and_cameras, one_file, run_points
from zenocap.tools.cli.live_page import FpsOption, ImageArguments, PageArguments
from zenocap.tools.cli.options import one_line_errors
from zenocap.tools.option_groups import EXPERT, RESEARCH, option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.camera.line_calibration import Measurements

Pair = tuple[float, float]

EXAMPLE = """# For zenocap calibrate lines: equal objects at A = (0, 0), B = (0, d_z), C = (d_x, 0), and their tops.
size = [160, 120]      # of the images, px
d_x = 1.0              # m
d_z = 1.0
t = 1.7                # height of the objects, m

[camera1]              # stands on +Z and looks to -Z
a = [79.5, 39.3]       # column and row of the top of A, px from the top left
b = [79.5, 34.5]
c = [108.3, 39.3]
distance = 5.2         # of the camera from the origin along Z, m, if measured
height = 1.0           # of the camera, m, if measured

[camera2]              # stands on -X and looks to +X
a = [79.5, 39.3]
b = [108.3, 39.3]
c = [79.5, 42.6]
distance = 5.2
height = 1.0
"""


@dataclass(frozen=True)
class LinesArguments:
    """live_size, fps: of the images that --live requests."""

    example: bool = option(False, "Print a TOML of measurements, and exit.")
    output: CalibrationOption = Path("calibration.toml")
    force: ForceOption = False
    live: LiveOption = False
    live_size: str = option("1280x720", "With --live: size of the images that is requested, px.", metavar="WxH")
    fps: FpsOption = 30.0


@dataclass(frozen=True)
class MeasurementArguments:
    """The measurements, in place of a file of them."""

    size: Pair | None = option(None, "Width and height of the images, px.")
    d_x: float | None = option(None, "Position of object C on the X axis, m.")
    d_z: float | None = option(None, "Position of object B on the Z axis, m.")
    t: float | None = option(None, "Height of the three objects, m.")
    a1: Pair | None = option(None, "Top of A in camera 1, column and row, px.")
    b1: Pair | None = option(None, "Top of B in camera 1.")
    c1: Pair | None = option(None, "Top of C in camera 1.")
    a2: Pair | None = option(None, "Top of A in camera 2.")
    b2: Pair | None = option(None, "Top of B in camera 2.")
    c2: Pair | None = option(None, "Top of C in camera 2.")
    distance1: float | None = option(None, "Camera 1 to origin along Z, m, if measured.")
    distance2: float | None = option(None, "Distance of camera 2 from the origin along X, m, if measured.")
    height1: float | None = option(None, "Height of camera 1, m, if measured.")
    height2: float | None = option(None, "Height of camera 2, m, if measured.")

    @property
    def needed(self) -> dict[str, object]:
        """Values by option, those that a file has too; None for one that is not given."""
        names = ("size", "d_x", "d_z", "t", "a1", "b1", "c1", "a2", "b2", "c2")
        return {f"--{name.replace('_', '-')}": getattr(self, name) for name in names}

    @property
    def given(self) -> list[str]:
        return [name for name, value in self.needed.items() if value is not None]

    def measurements(self) -> Measurements:
        """Raises typer.BadParameter for what is missing."""
        from zenocap.common.camera.line_calibration import Measurements, Pinnacles

        size, d_x, d_z, t = self.size, self.d_x, self.d_z, self.t
        tops = self.a1, self.b1, self.c1, self.a2, self.b2, self.c2
        if size is None or d_x is None or d_z is None or t is None or None in tops:
            missing = ", ".join(name for name, value in self.needed.items() if value is None)
            raise typer.BadParameter(f"give a TOML of measurements, or also {missing}")
        if any(side != int(side) for side in size):
            raise typer.BadParameter(f"--size {size[0]:g} {size[1]:g}: allowed: whole pixels")
        a1, b1, c1, a2, b2, c2 = cast("tuple[Pair, Pair, Pair, Pair, Pair, Pair]", tops)
        one, two = Pinnacles(a1, b1, c1, self.distance1, self.height1), Pinnacles(a2, b2, c2, self.distance2, self.height2)
        return Measurements((int(size[0]), int(size[1])), d_x, d_z, t, one, two)


def lines(
    measurements: FileAndCameras = None, *, given: LinesArguments, page: Annotated[PageArguments, EXPERT],
    typed: Annotated[MeasurementArguments, RESEARCH],
) -> None:  # fmt: skip
    """Calibrate two level cameras, aimed along the axes, from three upright objects of one height (the paper's method).

    Place them at A = (0, 0), B = (0, D_Z) and C = (D_X, 0); camera 1 on +Z looks to -Z, camera 2 on -X looks to +X, so
    that their axes cross above A. A drawing: docs, calibration-files.

    With --live, a page at http://127.0.0.1:8090 shows both pictures with their middle lines, in which the tops are placed,
    and at once what one pixel matters: `zenocap calibrate lines lines.toml --live cam01=/dev/video0 cam02=/dev/video2`
    """
    if given.example:
        typer.echo(EXAMPLE, nl=False)
        return
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.common.camera.line_calibration import calibrate_lines
    from zenocap.common.camera.line_sensitivity import sensitivity
    from zenocap.tools.setup.calibration.lines_file import solution_report, verdict

    output = given.output
    with one_line_errors():
        check_new(output, given.force)
        if given.live:
            _live(measurements, given, page, typed)
        measured = _measured(measurements, typed)
        solved = calibrate_lines(measured)
        cameras = {one.camera.name: one.camera for one in solved}
        write_result(output, given.force, lambda path, new: write_calibration(path, cameras, new=new))
    found = [sensitivity(measured, number, camera) for number, camera in enumerate(solved, start=1)]
    report = [line for camera, effects in zip(solved, found, strict=True) for line in solution_report(camera, effects)]
    raise typer.Exit(show([*report, f"written: {output}"], verdict(measured, solved, found)))


def _measured(texts: Sequence[str] | None, typed: MeasurementArguments) -> Measurements:
    """Measurements of the file, or of the options.  Raises UserError, typer.BadParameter."""
    from zenocap.tools.setup.calibration.lines_file import read_measurements

    if not texts:
        return typed.measurements()
    file = one_file(texts, "")
    if typed.given:
        raise typer.BadParameter(f"{file} has the measurements: leave out {', '.join(typed.given)}")
    return read_measurements(file)


def _live(texts: Sequence[str] | None, given: LinesArguments, page: PageArguments, typed: MeasurementArguments) -> NoReturn:
    """Measure and calibrate on a page, and end the command.  Raises UserError, typer.BadParameter."""
    from zenocap.tools.setup.page.points_lines import LinePoints

    if typed.given:
        raise typer.BadParameter(f"with --live the page has the measurements: leave out {', '.join(typed.given)}")
    path, sources = file_and_cameras(texts, "lines.toml")
    images, program = ImageArguments(given.live_size, given.fps), "zenocap calibrate lines --live"
    output, force = given.output, given.force
    run_points(sources, images, page, program, lambda names: LinePoints(names, path, output, force), output)
