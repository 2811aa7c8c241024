"""The group of commands `zenocap calibrate`."""

import typer

from zenocap.tools.cli.calibrate.board import board
from zenocap.tools.cli.calibrate.check import check
from zenocap.tools.cli.calibrate.convert import convert
from zenocap.tools.cli.calibrate.detect import detect
from zenocap.tools.cli.calibrate.drift import drift
from zenocap.tools.cli.calibrate.lines import lines
from zenocap.tools.cli.calibrate.print_board import print_board
from zenocap.tools.cli.calibrate.scene import scene
from zenocap.tools.cli.calibrate.walk import walk
from zenocap.tools.cli.expansion import expanded

calibrate = typer.Typer(help="Calibrate cameras; check and convert calibration files.", no_args_is_help=True)
calibrate.command()(expanded(board))
calibrate.command()(expanded(detect))
calibrate.command()(walk)
calibrate.command()(lines)
calibrate.command()(scene)
calibrate.command("print")(print_board)
calibrate.command()(drift)
calibrate.command()(check)
calibrate.command()(convert)
