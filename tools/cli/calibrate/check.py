"""Command calibrate check."""

import json
from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.options import one_line_errors


def check(
    file: Annotated[Path, typer.Argument(help="Calibration: anipose or Pose2Sim TOML, OpenCV, Qualisys.")],
    up_axis: Annotated[str, typer.Option(help="Up axis of the file's world: y or z.")] = "y",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print position and attitude of the cameras of a file, and the most nearly orthogonal pair."""
    from zenocap.common.camera.calibration_files import read_calibration
    from zenocap.tools.setup.calibration.camera_report import camera_data, camera_report

    with one_line_errors():
        cameras = read_calibration(file, up_axis)
    typer.echo(json.dumps(camera_data(cameras), indent=2) if as_json else "\n".join(camera_report(cameras)))
