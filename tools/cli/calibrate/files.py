"""Commands calibrate check and calibrate convert."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from zenocap.tools.cli.calibrate.output import ForceOption, check_new, writing
from zenocap.tools.cli.options import one_line_errors

Axis = Literal["y", "z"]


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


def convert(
    file: Annotated[
        Path, typer.Argument(help="Calibration: anipose, Pose2Sim or caliscope TOML, OpenCV, EasyMocap, Qualisys.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="File, or folder, to write.")],
    layout: Annotated[
        str, typer.Option(metavar="<anipose|caliscope|easymocap|qualisys|ros>", help="Layout to write: see below.")
    ] = "anipose",
    up_axis: Annotated[Axis, typer.Option(help="Up axis of the file's world.")] = "y",
    output_up_axis: Annotated[Axis, typer.Option(help="Up axis of the written world.")] = "y",
    force: ForceOption = False,
) -> None:
    """Convert a calibration for another program, or that of another program for zenocap.

    anipose: a .toml, also of Pose2Sim and of zenocap.  caliscope: a .toml.  easymocap: extri.yml, and intri.yml beside it.
    qualisys: a .qca.txt, also for Pose2Sim; lenses of 4 coefficients; usually with --output-up-axis z.
    ros: a folder with a camera_info file of each camera, which has no position.
    """
    from zenocap.common.camera.calibration_files import read_calibration, write_layout
    from zenocap.common.camera.calibration_layouts import LAYOUTS, writable

    if layout not in LAYOUTS.names() or not LAYOUTS.row(layout).write:
        raise typer.BadParameter(f"--layout {layout!r}: allowed: {', '.join(writable())}")
    with one_line_errors():
        cameras = read_calibration(file, up_axis)
        if not (layout == "ros" and output.is_dir() and not any(output.iterdir())):
            check_new(output, force)
        with writing(output):
            files = write_layout(output, cameras, layout, output_up_axis)
    for written in files:
        typer.echo(f"written: {written}")
    if layout == "ros":
        typer.echo("without the positions of the cameras, for which camera_info has no place")
