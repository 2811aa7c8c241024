"""Command calibrate board."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.calibrate.board_options import BoardArguments, SquareOption
from zenocap.tools.cli.calibrate.output import POOR, ForceOption, check_new, writing
from zenocap.tools.cli.live_page import FpsOption, HostOption, PortOption, SizeOption, TokenOption, page_table, run_page
from zenocap.tools.cli.options import DONE, FAILED, JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.camera.lens import Lens
    from zenocap.common.rig.animator import PageTable
    from zenocap.tools.calibration.board import Board
    from zenocap.tools.calibration.board_calibration import BoardCalibration
    from zenocap.tools.live.camera import LiveCamera
    from zenocap.tools.live.page import Mode


def board(
    *,
    films: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="FOLDER | VIDEO... | CAMERA...",
            help="Folder with a video, or a folder of images, for each camera; or the videos; or, in place of a video, its "
            ".corners file of `zenocap calibrate detect`.  With --live: a rig file, or NAME=SOURCE as for `zenocap film`; "
            "default: all cameras of this machine.",
            show_default=False,
        ),
    ] = None,
    square: SquareOption,
    board_options: BoardArguments,
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
    live: Annotated[
        bool, typer.Option("--live", help="Search the board in live cameras, on a page that tells what to show next.")
    ] = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    token: TokenOption = None,
    size: SizeOption = "1280x720",
    fps: FpsOption = 30.0,
) -> None:
    """Calibrate lenses, positions and delays of all cameras from videos of a printed board.

    Show the board to two or more cameras at once, move it slowly through the room, tilt it, bring it near each camera, and
    at last lay it on the floor: --floor says when.  Exit status 3 when the result is poor, with what to film next.

    Where videos stay on the machines of their cameras, `zenocap calibrate detect` there writes corners, which are used in
    place of the videos.

    With --live, a page at http://127.0.0.1:8090 shows the cameras with the corners of the board, which parts of each image
    were covered, which cameras saw the board together, and what to show next; its button calibrates.

    Examples: `zenocap calibrate board films --square 35`,
    `zenocap calibrate board --live left=/dev/video0 right=/dev/video2 --square 35`
    """
    from zenocap.common.camera.lens_files import read_lenses
    from zenocap.common.errors import UserError
    from zenocap.tools.calibration.board_calibration import calibrated_rig
    from zenocap.tools.calibration.board_films import board_films, board_views
    from zenocap.tools.calibration.board_report import report, report_data, verdict

    with one_line_errors():
        described = board_options.board(square)
        check_new(output, force)
        known = None if lenses is None else read_lenses(lenses)
        if live:
            if floor:
                raise UserError("--floor: allowed: without --live, whose page has a button for it")
            raise typer.Exit(_live(films or [], size, fps, page_table(host, port, token), described, known, delays, output))
        if not films:
            raise UserError("no videos: allowed: a folder with videos, the videos, or --live")
        found, notes = board_films([Path(film) for film in films])
        for note in notes:
            typer.echo(note, err=True)
        with progress("searching the board") as shown:
            seen_board, seen = board_views(
                described, found, lambda done, total, name: shown.update(done, total or None, name)
            )
            shown.restart("calibrating")
            result = calibrated_rig(seen_board, seen, known, floor or (), delays, lambda step: shown.update(0, note=step))
        write(result, output)
    word, reasons = verdict(result)
    if as_json:
        typer.echo(json.dumps(report_data(result) | {"written": str(output)}, indent=2))
    else:
        typer.echo("\n".join([*report(result), f"written: {output}"]))
        typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
        typer.echo(f"next: zenocap calibrate check {output}")
    if word == "poor":
        raise typer.Exit(POOR)


def write(found: BoardCalibration, output: Path) -> None:
    """Write the calibration file.  Raises UserError."""
    from zenocap.common.camera.calibration_files import write_calibration

    with writing(output):
        write_calibration(
            output,
            {one.camera.name: one.camera for one in found.cameras},
            error_px=max(one.residual_px for one in found.cameras),
        )


def _live(
    texts: Sequence[str],
    size: str,
    fps: float,
    table: PageTable,
    described: Board,
    lenses: Mapping[str, Lens] | None,
    delays: bool,
    output: Path,
) -> int:
    """Guide and calibrate on a page; returns the exit status, FAILED without a calibration."""
    from zenocap.tools.calibration.board_report import report, verdict
    from zenocap.tools.live.board_mode import BoardMode

    def written(found: BoardCalibration) -> str:
        write(found, output)
        word, reasons = verdict(found)
        typer.echo("\n".join([*report(found), f"written: {output}"]))
        typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
        return str(output)

    def make(cameras: Sequence[LiveCamera], epoch_ns: int) -> Mode:
        return BoardMode(cameras, described, epoch_ns, written, lenses, delays)

    mode = run_page(texts, size, fps, table, "zenocap calibrate board --live", make, loop=False)
    assert isinstance(mode, BoardMode)
    mode.close()
    if mode.result is None:
        typer.echo("nothing was calibrated", err=True)
        return FAILED
    typer.echo(f"next: zenocap calibrate check {output}")
    return POOR if verdict(mode.result)[0] == "poor" else DONE
