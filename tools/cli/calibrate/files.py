"""Commands calibrate check, calibrate convert and calibrate drift."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from zenocap.tools.cli.calibrate.output import ForceOption, check_new, write_result, writing
from zenocap.tools.cli.options import LOSS, JsonOption, TakePath, checked_take, echo, one_line_errors
from zenocap.tools.option_groups import option

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
            files = write_layout(output, cameras, layout, output_up_axis, new=not force)
    for written in files:
        typer.echo(f"written: {written}")
    guesses = {guess for camera in cameras.values() for guess in camera.guessed}
    for guess in sorted(guesses - {"vertical"} if layout == "ros" else guesses):
        names = ", ".join(camera.name for camera in cameras.values() if guess in camera.guessed)
        echo(f"the {guess} of camera {names} is a guess, and marked as one in what is written")
    if layout == "ros":
        typer.echo("without the positions of the cameras, for which camera_info has no place")


@dataclass(frozen=True)
class DriftArguments:
    """calibration: of the take.  up_axis: of its world.  output: calibration with the cameras as they are now."""

    calibration: Path | None = option(
        None, "Calibration that the take was recorded with, to be corrected; default: the cameras of the take."
    )
    up_axis: str = option("y", "Up axis of the calibration's world: y or z.")
    output: Path | None = option(None, "Calibration to write with the new poses of moved cameras.", "-o", "--output")
    force: ForceOption = False
    as_json: JsonOption = False


def drift(take: TakePath, *, given: DriftArguments) -> None:
    """Check on a take whether a camera was moved since the calibration, by how much, and where it is now.

    Compares the silhouettes of a person who walks through the area, half a minute of them. With three cameras or more it
    names the moved one; two do not show which one it was. Exit status 3: a camera was moved or could not be checked, or
    views disagree without such a reason.

    Example: `zenocap calibrate drift walk.mcap --calibration calibration.toml -o moved.toml`
    """
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.tools.setup.calibration import drift_report as report

    output = given.output
    with one_line_errors():
        checked_take(take)
        known = None if given.calibration is None else report.calibrated_cameras(given.calibration, given.up_axis)
        if output is not None:
            check_new(output, given.force)
        found, recorded = report.take_drift(take, report.messages_of(take))
        if output is not None and found.moved:
            now, up_axis = report.corrected(found, recorded, known), given.up_axis if known is not None else "y"
            write_result(output, given.force, lambda path, new: write_calibration(path, now, up_axis, new=new))
    if given.as_json:
        written = str(output) if output and found.moved else None
        typer.echo(json.dumps(report.drift_data(found) | {"written": written}, indent=2))
    else:
        typer.echo("\n".join(report.drift_lines(found)))
        if output is not None:
            typer.echo(f"written: {output}" if found.moved else "nothing is written")
        elif found.moved:
            typer.echo("next: the same with --calibration and -o writes a calibration with the new pose")
    if report.contradicts(found):
        raise typer.Exit(LOSS)
