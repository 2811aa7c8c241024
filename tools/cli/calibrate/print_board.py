"""Command calibrate print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.calibrate.board_options import PatternArguments
from zenocap.tools.cli.calibrate.output import ForceOption, check_new, writing
from zenocap.tools.cli.options import one_line_errors

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.setup.calibration.board import Board

Paper = Literal["a5", "a4", "a3", "a2", "a1", "a0", "letter", "legal", "tabloid"]


def print_board(
    output: Annotated[Path, typer.Option("-o", "--output", help="PDF file.")] = Path("board.pdf"),
    paper: Annotated[Paper, typer.Option(help="Paper.")] = "a4",
    square: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Side of a square, or tag.", show_default="the largest multiple of 5 that fits"),
    ] = None,
    force: ForceOption = False,
    *,
    pattern: PatternArguments,
) -> None:
    """Write a board for `zenocap calibrate board` as a PDF, true to scale: print it at 100 %, not "fit to page"."""
    from zenocap.common.atomic_write import write_atomically
    from zenocap.tools.setup.calibration.board_print import board_pdf, default_square

    with one_line_errors():
        # The side may depend on the numbers of squares.
        extent = pattern.board_of(10.0).extent
        side = default_square(*extent, paper) if square is None else square
        board = pattern.board_of(side)
        content = board_pdf(board, paper)
        check_new(output, force)
        with writing(output):
            write_atomically(output, content, new=not force)
    typer.echo(f"written: {output}: {board}, paper {paper}")
    piece = "tag" if pattern.kind == "aprilgrid" else "square"
    typer.echo(f"print at 100 %, not 'fit to page'; then measure a {piece}, and give its side to --square")
    typer.echo(f"next: zenocap calibrate board FOLDER {_options(board, side)}")


def _options(board: Board, side: float) -> str:
    """Options of `zenocap calibrate board` for a board, as far as they differ from the usual ones."""
    from zenocap.tools.setup.calibration.board import DEFAULT_DICTIONARY, DEFAULT_SPACING, usual_squares

    options = [f"--square {side:g}"]
    if board.kind != "charuco":
        options.append(f"--kind {board.kind}")
    if (board.columns, board.rows) != usual_squares(board.kind):
        options.append(f"--columns {board.columns} --rows {board.rows}")
    if board.kind == "charuco" and board.dictionary != DEFAULT_DICTIONARY:
        options.append(f"--dictionary {board.dictionary}")
    if board.kind == "aprilgrid" and board.spacing != DEFAULT_SPACING:
        options.append(f"--spacing {board.spacing:g}")
    return " ".join(options)
