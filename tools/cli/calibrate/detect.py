"""Command calibrate detect."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.calibrate.board_options import BoardArguments, SquareOption
from zenocap.tools.cli.calibrate.output import ForceOption, check_failures, check_new, gathering, write_result
from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.setup.calibration.board import Board
    from zenocap.tools.setup.calibration.board_films import BoardFilm

Films = Annotated[
    list[Path],
    typer.Argument(
        metavar="FOLDER | VIDEO...", help="Folder with a video, or a folder of images, for each camera; or the videos."
    ),
]


@dataclass(frozen=True)
class DetectArguments:
    """output: folder of the corners.  background: with low priority, for a camera host."""

    output: Path | None = option(
        None, "Folder to write.", "-o", "--output", metavar="FOLDER", show_default="corners in FOLDER, or here"
    )
    force: ForceOption = False
    as_json: JsonOption = False
    background: bool = option(False, "With low priority.", hidden=True)


def detect(
    films: Films, *, square: SquareOption, given: DetectArguments, board_options: Annotated[BoardArguments, EXPERT]
) -> None:
    """Detect a printed board in the films of this machine, and write the corners for a calibration on another machine.

    A file NAME.corners for each camera has the camera's name, the size of the images, and the times, numbers and image
    points of the corners: no picture. `zenocap calibrate board` takes it in place of the video, with the same result, from
    corners/ in the folder of the film; the board must be described by the same options there. A film that fails loses no
    other one; exit status 1 then.

    Example, on the camera's machine: `zenocap calibrate detect films/monday-20261123T221734Z --square 35`
    """
    from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX
    from zenocap.tools.setup.calibration.board_films import searchable_films

    if given.background:
        import logging

        from zenocap.common.runtime.priority import lower_priority

        lower_priority(logging.getLogger(__name__))
    with one_line_errors():
        described = board_options.board(square)
        found = searchable_films(films)
        folder = given.output or (films[0] / CORNERS if len(films) == 1 and films[0].is_dir() else Path(CORNERS))
        paths = [folder / f"{film.name}{CORNERS_SUFFIX}" for film in found]
        for path in paths:
            check_new(path, given.force)
        _detect_all(described, dict(zip(paths, found, strict=True)), given)


def _detect_all(described: Board, films: Mapping[Path, BoardFilm], given: DetectArguments) -> None:
    """Write the corners of each film to its path, and print what follows.  Raises UserError at the end, of all failures."""
    from zenocap.common.rig.folder import CORNERS

    written: list[dict[str, object]] = []
    failures: list[UserError] = []
    for path, film in films.items():
        with gathering(failures):
            written.append(_detected(described, film, path, given))
    if given.as_json:
        typer.echo(json.dumps({"board": str(described), "cameras": written}, indent=2))
    elif written:
        there = f"{CORNERS}/ of the film's folder where the calibration is made"
        typer.echo(f"next: copy into {there}; there, zenocap calibrate board")
    check_failures(failures)


def _detected(described: Board, film: BoardFilm, path: Path, given: DetectArguments) -> dict[str, object]:
    """Search the board in a film, and write the corners; a description of them, which is also printed.

    Raises UserError.
    """
    from zenocap.tools.setup.calibration.corners_file import write_corners
    from zenocap.tools.setup.calibration.detection import detected

    with progress("searching the board") as shown:
        one = detected(described, film.path, film.name, lambda done, total, name: shown.update(done, total or None, name))
    write_result(path, given.force, lambda target, new: write_corners(target, one, new=new))
    most = one.most
    if not given.as_json:
        share = f"in {most.coverage:.0%} of the image"
        typer.echo(f"{film.name}: {len(most.views)} of {one.looks} images show the board, {share}")
        typer.echo(f"  written: {path}, {path.stat().st_size / 1e6:.1f} MB")
    views = {"name": film.name, "images": one.looks, "views": len(most.views), "coverage": most.coverage}
    return views | {"written": str(path)}
