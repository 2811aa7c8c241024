"""The group of commands `zenocap calibrate`."""

import typer

from zenocap.tools.cli.calibrate.check import check
from zenocap.tools.cli.calibrate.lines import EXAMPLE, lines

calibrate = typer.Typer(help="Calibrate cameras, and check calibration files.", no_args_is_help=True)
calibrate.command(epilog=EXAMPLE.replace("\n\n    ", "\n\n\b\n    "))(lines)
calibrate.command()(check)
