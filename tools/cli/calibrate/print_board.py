"""Command calibrate print."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from zenocap.tools.cli.calibrate.output import ForceOption, check_new, writing
from zenocap.tools.cli.options import one_line_errors

Kind = Literal["charuco", "chessboard", "aprilgrid"]
Paper = Literal["a5", "a4", "a3", "a2", "a1", "a0", "letter", "legal", "tabloid"]


def print_board(
    output: Annotated[Path, typer.Option("-o", "--output", help="PDF file.")] = Path("board.pdf"),
    paper: Annotated[Paper, typer.Option(help="Paper.")] = "a4",
    kind: Annotated[Kind, typer.Option(help="Kind of the board; a ChArUco board may be partly hidden.")] = "charuco",
    columns: Annotated[
        int | None, typer.Option(help="Squares, or tags, in a row.", show_default="5, of other kinds 6")
    ] = None,
    rows: Annotated[
        int | None,
        typer.Option(help="Squares, or tags, in a column.", show_default="7, of a chessboard 9, of an AprilGrid 6"),
    ] = None,
    square: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Side of a square, or tag.", show_default="the largest multiple of 5 that fits"),
    ] = None,
    dictionary: Annotated[
        str | None, typer.Option(help="Markers, such as 4x4_50 or 5x5_1000.", show_default="4x4_50")
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(help="White between two tags of an AprilGrid, by the side of a tag.", show_default="0.3, as Kalibr"),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a board for `zenocap calibrate board` as a PDF, true to scale: print it at 100 %, not "fit to page"."""
    from zenocap.tools.calibration.board import (
        DEFAULT_DICTIONARY,
        DEFAULT_SPACING,
        checked_board,
        usual_squares,
    )
    from zenocap.tools.calibration.board_print import board_pdf, default_square

    usual = usual_squares(kind)
    across, down = usual[0] if columns is None else columns, usual[1] if rows is None else rows
    with one_line_errors():
        # The side may depend on the numbers of squares.
        extent = checked_board(kind, across, down, 10.0, dictionary=dictionary, spacing=spacing).extent
        side = default_square(*extent, paper) if square is None else square
        board = checked_board(kind, across, down, side, dictionary=dictionary, spacing=spacing)
        content = board_pdf(board, paper)
        check_new(output, force)
        with writing(output):
            output.write_bytes(content)
    options = [f"--square {side:g}"]
    if kind != "charuco":
        options.append(f"--kind {kind}")
    if (across, down) != usual:
        options.append(f"--columns {across} --rows {down}")
    if kind == "charuco" and board.dictionary != DEFAULT_DICTIONARY:
        options.append(f"--dictionary {board.dictionary}")
    if kind == "aprilgrid" and board.spacing != DEFAULT_SPACING:
        options.append(f"--spacing {board.spacing:g}")
    typer.echo(f"written: {output}: {board}, paper {paper}")
    piece = "tag" if kind == "aprilgrid" else "square"
    typer.echo(f"print at 100 %, not 'fit to page'; then measure a {piece}, and give its side to --square")
    typer.echo(f"next: zenocap calibrate board FOLDER {' '.join(options)}")
