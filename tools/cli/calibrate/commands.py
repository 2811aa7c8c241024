"""The group of commands `zenocap calibrate`."""

from collections.abc import Callable

import typer

from zenocap.tools.cli.calibrate.board import board
from zenocap.tools.cli.calibrate.detect import detect
from zenocap.tools.cli.calibrate.files import check, convert, drift
from zenocap.tools.cli.calibrate.lines import lines
from zenocap.tools.cli.calibrate.print_board import print_board
from zenocap.tools.cli.calibrate.scene import scene
from zenocap.tools.cli.calibrate.walk import walk
from zenocap.tools.option_groups import add_command

calibrate = typer.Typer(help="Calibrate cameras; check and convert calibration files.", no_args_is_help=True)
COMMANDS: tuple[Callable[..., None], ...] = (board, detect, walk, lines, scene, print_board, drift, check, convert)
for command in COMMANDS:
    add_command(calibrate, command, "print" if command is print_board else None)
