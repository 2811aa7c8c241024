"""The group of commands `zenocap calibrate`."""

import typer

from zenocap.tools.cli.calibrate.check import check
from zenocap.tools.cli.calibrate.convert import convert
from zenocap.tools.cli.calibrate.lines import EXAMPLE, lines

calibrate = typer.Typer(help="Calibrate cameras; check and convert calibration files.", no_args_is_help=True)
# The help text is markup: "\b" keeps the lines of a paragraph, and a table's name in brackets would be taken for a style.
calibrate.command(epilog=EXAMPLE.replace("\n\n    ", "\n\n\b\n    ").replace("[camera", r"\[camera"))(lines)
calibrate.command()(check)
calibrate.command()(convert)
