"""Command calibrate walk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.calibrate.output import (
    CalibrationOption,
    ForceOption,
    LensesOption,
    check_new,
    finish,
    gathering,
    write_result,
)
from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.setup.calibration.walk.calibration import WalkCalibration

WalkFolder = Annotated[Path, typer.Argument(help="Folder with videos/, one for each camera, such as `zenocap film` makes.")]


@dataclass(frozen=True)
class WalkArguments:
    """height: of the person, m.  seconds: of the videos that are used."""

    height: Annotated[float, typer.Option(metavar="M", help="Height of the person, in shoes, m.")]
    lenses: LensesOption
    seconds: float = option(90.0, "Length of the part to use, from the beginning (s).", min=2, max=600)
    output: CalibrationOption = Path("calibration.toml")
    force: ForceOption = False
    as_json: JsonOption = False


def walk(folder: WalkFolder, *, given: WalkArguments) -> None:
    """Calibrate the positions of all cameras without a board, from one person who walks about.

    The person walks through the whole area for half a minute, in curves, upright, and is seen from head to feet by two
    cameras or more at a time. The lenses must be known. Cameras may be out of step by up to a second: what their images are
    late by is found too, and written to FOLDER/sync.toml, which `zenocap track FOLDER` uses. Exit status 3 when the result
    is poor, with what to do better.

    Example: `zenocap calibrate walk monday --height 1.75 --lenses lenses.toml -o calibration.toml`
    """
    from zenocap.tools.setup.calibration.walk.report import report, report_data, verdict

    with one_line_errors():
        found, lines, failures = _calibrated(folder, given)
    data = report_data(found) if given.as_json else None
    output = given.output if f"written: {given.output}" in lines else None
    finish(output, [*report(found), *lines], verdict(found), data, failures)


def _calibrated(folder: Path, given: WalkArguments) -> tuple[WalkCalibration, list[str], list[UserError]]:
    """Calibrate and write the files; the result, lines about the files, and failures to write them.  Raises UserError."""
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.common.camera.lens_files import read_lenses
    from zenocap.tools.setup.calibration.walk.calibration import calibrated_films
    from zenocap.tools.setup.calibration.walk.films import filmed
    from zenocap.tools.setup.calibration.walk.parameters import STATURES_M

    height, output = given.height, given.output
    if not STATURES_M[0] <= height <= STATURES_M[1]:
        raise UserError(f"--height {height:g}: allowed: {STATURES_M[0]:g} to {STATURES_M[1]:g} m")
    check_new(output, given.force)
    known = read_lenses(given.lenses)
    with progress("segmenting") as shown:
        films = filmed(folder, known, given.seconds, shown.update)
        shown.restart("calibrating")
        found = calibrated_films(films.cameras, films.timing, height, films.hulls, lambda step: shown.update(0, note=step))
    for note in films.notes:
        typer.echo(f"note: {note}", err=True)
    cameras = {one.camera.name: one.camera for one in found.cameras}
    error_px = max(one.off_px for one in found.cameras)
    lines: list[str] = []
    failures: list[UserError] = []
    with gathering(failures):
        write_result(output, given.force, lambda path, new: write_calibration(path, cameras, error_px=error_px, new=new))
        lines.append(f"written: {output}")
    late = {name: films.begins[name] + (one.seconds if one.is_certain else 0.0) for name, one in found.delays.items()}
    if any(one.is_certain for one in found.delays.values()):
        with gathering(failures):
            lines += sync_lines(folder, late, given.force)
    return found, lines, failures


def sync_lines(folder: Path, begins: Mapping[str, float], force: bool) -> list[str]:
    """Write when the videos of a folder begin, s by camera, unless there is such a file; lines for the user.

    Raises UserError where it cannot be written.
    """
    from zenocap.common.rig.folder import SYNC_FILE
    from zenocap.tools.setup.sync.synchronize import sync_text, write_sync

    path, comment = folder / SYNC_FILE, "Written by zenocap calibrate walk; seconds at which each camera's video begins"
    if path.exists() and not force:
        text = sync_text(begins, comment).rstrip()
        return [f"not written: {path} exists: --force replaces it; the calibration holds with these times:", text]
    return [f"written: {write_sync(folder, begins, comment)}"]
