"""Options that describe a printed board."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from pathlib import Path

    from zenocap.common.messages import FilmBoard
    from zenocap.tools.calibration.board import Board

Kind = Literal["charuco", "chessboard", "aprilgrid"]

SquareOption = Annotated[
    float,
    typer.Option(
        metavar="MM", help="Side of a square, or of a tag of an AprilGrid, mm, measured on the print.", show_default=False
    ),
]
OptionalSquareOption = Annotated[
    float | None,
    typer.Option(
        metavar="MM",
        help="Search a printed board with squares, or tags, of this side (mm) in the films that stay on other machines, "
        "and copy its corners; the other options of the board are those of `zenocap calibrate board`.",
        show_default=False,
    ),
]
ColumnsOption = Annotated[int | None, typer.Option(help="Squares, or tags, in a row.", show_default="5, of other kinds 6")]
RowsOption = Annotated[
    int | None,
    typer.Option(help="Squares, or tags, in a column.", show_default="7, of a chessboard 9, of an AprilGrid 6"),
]
KindOption = Annotated[Kind, typer.Option(help="Kind of the board.")]
MarkerOption = Annotated[
    float | None, typer.Option(metavar="MM", help="Side of a marker, mm; 0.75 of the square when left out.")
]
DictionaryOption = Annotated[str | None, typer.Option(help="Markers, such as 4x4_50 or 5x5_1000.", show_default="4x4_50")]
SpacingOption = Annotated[
    float | None,
    typer.Option(help="White between two tags of an AprilGrid, by the side of a tag.", show_default="0.3, as Kalibr"),
]


def described_board(
    kind: Kind,
    columns: int | None,
    rows: int | None,
    square: float,
    marker: float | None,
    dictionary: str | None,
    spacing: float | None,
) -> Board:
    """The board of these options.  Raises UserError."""
    from zenocap.tools.calibration.board import checked_board, usual_squares

    usual = usual_squares(kind)
    squares = usual[0] if columns is None else columns, usual[1] if rows is None else rows
    return checked_board(kind, *squares, square, marker, dictionary, spacing)


def film_board(
    kind: Kind,
    columns: int | None,
    rows: int | None,
    square: float | None,
    marker: float | None,
    dictionary: str | None,
    spacing: float | None,
) -> FilmBoard | None:
    """The same for a film query; None without a square.  Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.common.messages import FilmBoard

    if square is None:
        if kind != "charuco" or any(one is not None for one in (columns, rows, marker, dictionary, spacing)):
            raise UserError("options of a board: allowed: with --square")
        return None
    board = described_board(kind, columns, rows, square, marker, dictionary, spacing)
    return FilmBoard(
        kind=kind, columns=board.columns, rows=board.rows, square_mm=square, marker_mm=marker, dictionary=dictionary,
        spacing=spacing,
    )  # fmt: skip


def board_words(board: FilmBoard) -> list[str]:
    """Options of a board that differ from what is usual, for a command line."""
    from zenocap.tools.calibration.board import usual_squares

    words = [f"--square={board.square_mm!r}"]
    words += [f"--kind={board.kind}"] * (board.kind != "charuco")
    if (board.columns, board.rows) != usual_squares(board.kind):
        words += [f"--columns={board.columns}", f"--rows={board.rows}"]
    for option, value in (("marker", board.marker_mm), ("dictionary", board.dictionary), ("spacing", board.spacing)):
        words += [f"--{option}={value}"] * (value is not None)
    return words


def detect_command(board: FilmBoard, video: Path, folder: Path) -> list[str]:
    """Command that detects a board in a video, with low priority, and writes the corners into a folder."""
    command = [sys.executable, "-P", "-m", "zenocap", "calibrate", "detect", str(video), "-o", str(folder)]
    return [*command, *board_words(board), "--force", "--json", "--background"]
