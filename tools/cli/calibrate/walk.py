"""Command calibrate walk."""

import json
from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.calibrate.lines import POOR
from zenocap.tools.cli.calibrate.output import ForceOption, check_new, writing
from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress


def walk(
    folder: Annotated[
        Path,
        typer.Argument(help="Folder with videos/, one for each camera, such as `zenocap film` makes.", show_default=False),
    ],
    height: Annotated[
        float,
        typer.Option(metavar="M", help="Height of the person, in shoes, m.", show_default=False),
    ],
    lenses: Annotated[
        Path,
        typer.Option(
            help="Lenses of the cameras: any calibration, ROS camera_info, OpenCV, or a folder of these; a single lens is "
            "that of all cameras.",
            show_default=False,
        ),
    ],
    seconds: Annotated[
        float, typer.Option(min=2, max=600, help="Length of the part to use, from the beginning (s).")
    ] = 90.0,
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")] = Path("calibration.toml"),
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Calibrate the positions of all cameras without a board, from one person who walks about.

    The person walks through the whole area for half a minute, in curves, upright, and is seen from head to feet by two
    cameras or more at a time. The lenses must be known. Exit status 3 when the result is poor, with what to do better.

    Example: `zenocap calibrate walk monday --height 1.75 --lenses lenses.toml -o calibration.toml`
    """
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.common.camera.lens_files import read_lenses
    from zenocap.common.errors import UserError
    from zenocap.tools.calibration.walk.calibration import calibrated_walk
    from zenocap.tools.calibration.walk.films import filmed
    from zenocap.tools.calibration.walk.parameters import STATURES_M
    from zenocap.tools.calibration.walk.report import report, report_data, verdict

    with one_line_errors():
        if not STATURES_M[0] <= height <= STATURES_M[1]:
            raise UserError(f"--height {height:g}: allowed: {STATURES_M[0]:g} to {STATURES_M[1]:g} m")
        check_new(output, force)
        known = read_lenses(lenses)
        with progress("segmenting") as shown:
            films = filmed(folder, known, seconds, shown.update)
            shown.restart("calibrating")
            found = calibrated_walk(films.cameras, films.hulls, height, lambda step: shown.update(0, note=step))
        for note in films.notes:
            typer.echo(f"note: {note}", err=True)
        with writing(output):
            write_calibration(
                output,
                {one.camera.name: one.camera for one in found.cameras},
                error_px=max(one.off_px for one in found.cameras),
            )
    word, reasons = verdict(found)
    if as_json:
        typer.echo(json.dumps(report_data(found) | {"written": str(output)}, indent=2))
    else:
        typer.echo("\n".join([*report(found), f"written: {output}"]))
        typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
        typer.echo(f"next: zenocap calibrate check {output}")
    if word == "poor":
        raise typer.Exit(POOR)
