"""Options that describe a printed board."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.calibration.board import Board

Kind = Literal["charuco", "chessboard", "aprilgrid"]

SquareOption = Annotated[
    float,
    typer.Option(
        metavar="MM", help="Side of a square, or of a tag of an AprilGrid, mm, measured on the print.", show_default=False
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
