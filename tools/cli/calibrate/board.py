"""Command calibrate board."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.calibrate.board_options import BoardArguments, SquareOption
from zenocap.tools.cli.calibrate.output import (
    POOR,
    CalibrationOption,
    ForceOption,
    check_new,
    finish,
    show,
    write_result,
    writing,
)
from zenocap.tools.cli.live_page import ImageArguments, PageArguments, run_page
from zenocap.tools.cli.options import DONE, FAILED, JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.camera.lens import Lens
    from zenocap.common.rig.animator import PageTable
    from zenocap.tools.setup.calibration.board import Board
    from zenocap.tools.setup.calibration.board_calibration import BoardCalibration
    from zenocap.tools.setup.page.camera import LiveCamera
    from zenocap.tools.setup.page.page import PageMode

Films = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="FOLDER | VIDEO... | CAMERA...",
        help="Folder with a video, or a folder of images, for each camera; or the videos; or, in place of a video, its "
        ".corners file of `zenocap calibrate detect`.  With --live: a rig file, or NAME=SOURCE as for `zenocap film`; "
        "default: all cameras of this machine.",
    ),
]


@dataclass(frozen=True)
class BoardCalibrationArguments:
    """floor: times at which the board lies there, s.  lenses: that are known."""

    floor: list[float] | None = option(
        None, "Time at which the board lies on the floor, seconds of the videos; may be repeated.", metavar="S"
    )
    lenses: Path | None = option(
        None, "Lenses that are known and stay: a calibration, ROS camera_info, OpenCV, or a folder of these."
    )
    output: CalibrationOption = Path("calibration.toml")
    force: ForceOption = False
    as_json: JsonOption = False
    live: bool = option(False, "Search the board in live cameras, on a page that guides.")


@dataclass(frozen=True)
class DelaysArguments:
    """Whether delays are estimated."""

    delays: bool = option(True, "Estimate camera delays.", "--delays/--no-delays")


def board(
    films: Films = None, *, square: SquareOption, given: BoardCalibrationArguments, images: ImageArguments,
    board_options: Annotated[BoardArguments, EXPERT], expert: Annotated[DelaysArguments, EXPERT],
    page: Annotated[PageArguments, EXPERT],
) -> None:  # fmt: skip
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
    from zenocap.tools.setup.calibration.board_report import report, report_data, verdict

    output = given.output
    with one_line_errors():
        described = board_options.board(square)
        check_new(output, given.force)
        known = None if given.lenses is None else read_lenses(given.lenses)
        if given.live:
            if given.floor:
                raise UserError("--floor: allowed: without --live, whose page has a button for it")
            raise typer.Exit(_live(films or [], images, page.table(), described, known, given, delays=expert.delays))
        if not films:
            raise UserError("no videos: allowed: a folder with videos, the videos, or --live")
        result = _calibrated(films, described, known, given.floor or (), delays=expert.delays)
        write_result(output, given.force, partial(write, result))
    data = report_data(result) if given.as_json else None
    finish(output, [*report(result), f"written: {output}"], verdict(result), data)


def _calibrated(
    films: Sequence[str], described: Board, lenses: Mapping[str, Lens] | None, floor: Sequence[float], *, delays: bool
) -> BoardCalibration:
    """Search the board in films and calibrate, with progress.  Raises UserError."""
    from zenocap.tools.setup.calibration.board_calibration import calibrated_rig
    from zenocap.tools.setup.calibration.board_films import board_films, board_views, check_floor

    found, notes = board_films([Path(film) for film in films])
    for note in notes:
        typer.echo(note, err=True)
    check_floor(found, floor)
    with progress("searching the board") as shown:
        seen_board, seen = board_views(described, found, lambda done, total, name: shown.update(done, total or None, name))
        shown.restart("calibrating")
        return calibrated_rig(seen_board, seen, lenses, floor, delays, lambda step: shown.update(0, note=step))


def write(found: BoardCalibration, path: Path, new: bool) -> None:
    """Write the calibration file.  Raises as `write_calibration`."""
    from zenocap.common.camera.calibration_files import write_calibration

    cameras = {one.camera.name: one.camera for one in found.cameras}
    write_calibration(path, cameras, error_px=max(one.residual_px for one in found.cameras), new=new)


def _live(
    texts: Sequence[str], images: ImageArguments, table: PageTable, described: Board, lenses: Mapping[str, Lens] | None,
    given: BoardCalibrationArguments, *, delays: bool,
) -> int:  # fmt: skip
    """Guide and calibrate on a page; returns the exit status, FAILED without a calibration.  Raises UserError."""
    from zenocap.tools.setup.calibration.board_report import report, verdict
    from zenocap.tools.setup.page.board_mode import BoardMode

    output, replaced = given.output, given.force

    def written(found: BoardCalibration) -> str:
        nonlocal replaced
        with writing(output):
            write(found, output, not replaced)
        replaced = True  # that of this page
        show([*report(found), f"written: {output}"], verdict(found))
        return str(output)

    def make(cameras: Sequence[LiveCamera], epoch_ns: int) -> PageMode:
        return BoardMode(cameras, described, epoch_ns, written, lenses, delays)

    mode = run_page(texts, images, table, "zenocap calibrate board --live", make, loop=False)
    assert isinstance(mode, BoardMode)
    mode.close()
    if mode.result is None:
        typer.echo("nothing was calibrated", err=True)
        return FAILED
    typer.echo(f"next: zenocap calibrate check {output}")
    return POOR if verdict(mode.result)[0] == "poor" else DONE
