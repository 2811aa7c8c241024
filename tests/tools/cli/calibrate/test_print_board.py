"""`calibrate print`: defaults, the command that follows, and wrong options."""

from functools import partial
from typing import get_args

import pytest

from tests.support.command import printed, refused
from zenocap.tools.cli.calibrate.print_board import Paper
from zenocap.tools.setup.calibration.board import DEFAULT_APRILGRID, DEFAULT_CHESSBOARD, DEFAULT_COLUMNS, DEFAULT_ROWS
from zenocap.tools.setup.calibration.board_print import PAPERS

COMMAND = ("calibrate", "print")
print_board = partial(printed, *COMMAND)


@pytest.mark.parametrize(
    ("options", "follows"),
    [
        ("", "--square 35\n"),
        ("--paper letter", "--square 30\n"),
        ("--kind chessboard", "--square 25 --kind chessboard\n"),
        ("--kind aprilgrid", "--square 20 --kind aprilgrid\n"),
        (
            "--kind aprilgrid --columns 4 --rows 5 --spacing 0.25 --square 30",
            "--square 30 --kind aprilgrid --columns 4 --rows 5 --spacing 0.25\n",
        ),
        (
            "--columns 11 --rows 10 --dictionary 5x5_100 --square 22.5 --paper a3",
            "--square 22.5 --columns 11 --rows 10 --dictionary 5x5_100\n",
        ),
    ],
)
def test_a_board_is_written_and_the_next_command_describes_it(tmp_path, options, follows):
    assert print_board("-o", tmp_path / "a.pdf", *options.split()).endswith(
        f"next: zenocap calibrate board FOLDER {follows}"
    )
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF-1.4")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--square 40", "error: --square 40: 5 x 7 squares do not fit --paper a4"),
        ("--square nan", "error: --square nan: allowed: the side of a square, 2 to 1000 mm"),
        ("--kind aprilgrid --square 30", "error: --square 30: 6 x 6 tags do not fit --paper a4"),
    ],
)
def test_wrong_options_are_one_line_and_write_nothing(tmp_path, options, message):
    """Wrong boards: tests/tools/setup/calibration/test_board.py."""
    assert refused(*COMMAND, "-o", tmp_path / "a.pdf", *options.split()).startswith(message)
    assert not (tmp_path / "a.pdf").exists()


def test_an_existing_file_stays_without_force_and_a_missing_folder_is_named(tmp_path):
    (tmp_path / "a.pdf").write_text("other")
    error = refused(*COMMAND, "-o", tmp_path / "a.pdf")
    assert "a.pdf: exists already: allowed: another name, or --force" in error
    assert (tmp_path / "a.pdf").read_text() == "other"
    print_board("-o", tmp_path / "a.pdf", "--force")
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    assert "a.pdf: cannot be written: No such file" in refused(*COMMAND, "-o", tmp_path / "none" / "a.pdf")


def test_the_help_states_the_papers_and_defaults():
    assert set(get_args(Paper)) == set(PAPERS)
    text = " ".join(print_board("--help").replace("│", " ").split())
    columns, rows = DEFAULT_CHESSBOARD
    assert f"{DEFAULT_COLUMNS}, of other kinds {columns}" in text
    assert DEFAULT_APRILGRID[0] == columns
    assert f"{DEFAULT_ROWS}, of a chessboard {rows}, of an AprilGrid {DEFAULT_APRILGRID[1]}" in text
