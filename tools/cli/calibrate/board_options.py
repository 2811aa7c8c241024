"""Options that describe a printed board."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from pathlib import Path

    from zenocap.common.messages import FilmBoard
    from zenocap.tools.setup.calibration.board import Board

Kind = Literal["charuco", "chessboard", "aprilgrid"]

SquareOption = Annotated[
    float, typer.Option(metavar="MM", help="Side of a square, or of a tag of an AprilGrid, mm, measured on the print.")
]
OptionalSquareOption = Annotated[
    float | None,
    typer.Option(
        metavar="MM",
        help="Search a printed board with squares, or tags, of this side (mm) in the films that stay on other machines, "
        "and copy its corners; the other options of the board are those of `zenocap calibrate board`.",
    ),
]


@dataclass(frozen=True)
class PatternArguments:
    """The options that describe the pattern of a board, all but the sides of its squares and markers."""

    columns: int | None = option(None, "Squares, or tags, in a row.", show_default="5, of other kinds 6")
    rows: int | None = option(
        None, "Squares, or tags, in a column.", show_default="7, of a chessboard 9, of an AprilGrid 6"
    )
    kind: Kind = option("charuco", "Kind of the board; a ChArUco board may be partly hidden.")
    dictionary: str | None = option(None, "Markers, such as 4x4_50 or 5x5_1000.", show_default="4x4_50")
    spacing: float | None = option(
        None, "White between two tags of an AprilGrid, by the side of a tag.", show_default="0.3, as Kalibr"
    )

    def board_of(self, square_mm: float, marker_mm: float | None = None) -> Board:
        """The board with squares, or tags, of this side.  Raises UserError."""
        from zenocap.tools.setup.calibration.board import checked_board, usual_squares

        usual = usual_squares(self.kind)
        squares = usual[0] if self.columns is None else self.columns, usual[1] if self.rows is None else self.rows
        return checked_board(self.kind, *squares, square_mm, marker_mm, self.dictionary, self.spacing)


@dataclass(frozen=True)
class BoardArguments(PatternArguments):
    """The options that describe a board, all but the side of its squares."""

    marker: float | None = option(None, "Side of a marker, mm; 0.75 of the square when left out.", metavar="MM")

    def board(self, square_mm: float) -> Board:
        """The board with squares, or tags, of this side.  Raises UserError."""
        return self.board_of(square_mm, self.marker)

    def film_board(self, square_mm: float | None) -> FilmBoard | None:
        """The same for a film query; None without a side.  Raises UserError."""
        from zenocap.common.messages import FilmBoard

        if square_mm is None:
            if self != BoardArguments():
                raise UserError("options of a board: allowed: with --square")
            return None
        board = self.board(square_mm)
        return FilmBoard(
            kind=self.kind, columns=board.columns, rows=board.rows, square_mm=square_mm, marker_mm=self.marker,
            dictionary=self.dictionary, spacing=self.spacing,
        )  # fmt: skip


def board_words(board: FilmBoard) -> list[str]:
    """Options of a board that differ from what is usual, for a command line."""
    from zenocap.tools.setup.calibration.board import usual_squares

    words = [f"--square={board.square_mm!r}"]
    words += [f"--kind={board.kind}"] * (board.kind != "charuco")
    if (board.columns, board.rows) != usual_squares(board.kind):
        words += [f"--columns={board.columns}", f"--rows={board.rows}"]
    for name, value in (("marker", board.marker_mm), ("dictionary", board.dictionary), ("spacing", board.spacing)):
        words += [f"--{name}={value}"] * (value is not None)
    return words


def detect_command(board: FilmBoard, video: Path, folder: Path) -> list[str]:
    """Command that detects a board in a video, with low priority, and writes the corners into a folder."""
    command = [sys.executable, "-P", "-m", "zenocap", "calibrate", "detect", str(video), "-o", str(folder)]
    return [*command, *board_words(board), "--force", "--json", "--background"]
