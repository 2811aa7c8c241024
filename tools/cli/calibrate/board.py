"""Command calibrate board."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from zenocap.tools.cli.calibrate.lines import POOR
from zenocap.tools.cli.calibrate.output import ForceOption, check_new, writing
from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress

Kind = Literal["charuco", "chessboard"]


def board(
    films: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER | VIDEO...",
            help="Folder with a video, or a folder of images, for each camera; or the videos.",
            show_default=False,
        ),
    ],
    square: Annotated[
        float, typer.Option(metavar="MM", help="Side of a square, mm, measured on the print.", show_default=False)
    ],
    columns: Annotated[int | None, typer.Option(help="Squares in a row.", show_default="5, of a chessboard 6")] = None,
    rows: Annotated[int | None, typer.Option(help="Squares in a column.", show_default="7, of a chessboard 9")] = None,
    kind: Annotated[Kind, typer.Option(help="Kind of the board.")] = "charuco",
    marker: Annotated[
        float | None, typer.Option(metavar="MM", help="Side of a marker, mm; 0.75 of the square when left out.")
    ] = None,
    dictionary: Annotated[str, typer.Option(help="Markers, such as 4x4_50 or 5x5_1000.")] = "4x4_50",
    floor: Annotated[
        list[float] | None,
        typer.Option(
            metavar="S", help="Time at which the board lies on the floor, seconds of the videos; may be repeated."
        ),
    ] = None,
    lenses: Annotated[
        Path | None,
        typer.Option(help="Lenses that are known and stay: a calibration, ROS camera_info, OpenCV, or a folder of these."),
    ] = None,
    delays: Annotated[
        bool, typer.Option("--delays/--no-delays", help="Estimate by how long each camera's images are late.")
    ] = True,
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")] = Path("calibration.toml"),
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Calibrate lenses, positions and delays of all cameras from videos of a printed board.

    Show the board to two or more cameras at once, move it slowly through the room, tilt it, bring it near each camera, and
    at last lay it on the floor: --floor says when.  Exit status 3 when the result is poor, with what to film next.
    """
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.common.camera.lens_files import read_lenses
    from zenocap.tools.calibration.board import checked_board, usual_squares
    from zenocap.tools.calibration.board_calibration import calibrated_rig
    from zenocap.tools.calibration.board_films import board_films, board_views
    from zenocap.tools.calibration.board_report import report, report_data, verdict

    with one_line_errors():
        usual = usual_squares(kind)
        squares = usual[0] if columns is None else columns, usual[1] if rows is None else rows
        described = checked_board(kind, *squares, square, marker, dictionary)
        check_new(output, force)
        known = None if lenses is None else read_lenses(lenses)
        found, notes = board_films(films)
        for note in notes:
            typer.echo(note, err=True)
        with progress("searching the board") as shown:
            seen_board, seen = board_views(
                described, found, lambda done, total, name: shown.update(done, total or None, name)
            )
            shown.restart("calibrating")
            result = calibrated_rig(seen_board, seen, known, floor or (), delays, lambda step: shown.update(0, note=step))
        with writing(output):
            write_calibration(
                output,
                {one.camera.name: one.camera for one in result.cameras},
                error_px=max(one.residual_px for one in result.cameras),
            )
    word, reasons = verdict(result)
    if as_json:
        typer.echo(json.dumps(report_data(result) | {"written": str(output)}, indent=2))
    else:
        typer.echo("\n".join([*report(result), f"written: {output}"]))
        typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
        typer.echo(f"next: zenocap calibrate check {output}")
    if word == "poor":
        raise typer.Exit(POOR)
