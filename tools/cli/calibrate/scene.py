"""Command calibrate scene."""

import json
from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.calibrate.output import POOR, ForceOption, check_new, writing
from zenocap.tools.cli.calibrate.points_page import FileAndCameras, LiveOption, file_and_cameras, one_file, run_points
from zenocap.tools.cli.live_page import FpsOption, HostOption, PortOption, SizeOption, TokenOption
from zenocap.tools.cli.options import JsonOption, one_line_errors

SCENE_EXAMPLE = """# For zenocap calibrate scene: points of the room, measured with a tape, and where each camera sees them.
size = [640, 480]               # of the images, px; may be left out with --lenses

[points]                        # X, Y and Z in m: Y is the height above the floor
corner = [0.0, 0.0, 0.0]        # of a tile
mark = [0.0, 0.0, 1.5]
door = [1.5, 0.0, 0.0]
pole = [1.4, 1.2, -1.3]         # top of an upright pole
lamp = [-1.5, 2.0, 1.0]
shelf = [0.0, 1.8, -1.5]

[cam01]                         # column and row, px from the top left, of the points that it sees
corner = [319.5, 354.9]
mark = [319.5, 401.7]
door = [492.6, 354.9]
pole = [448.7, 221.0]
lamp = [105.2, 96.6]
shelf = [319.5, 167.9]
"""


def scene(
    points: FileAndCameras = None,
    lenses: Annotated[
        Path | None,
        typer.Option(
            help="Lenses of the cameras: any calibration, ROS camera_info, OpenCV, or a folder of these; a single lens is "
            "that of all cameras.  Without: the focal length is estimated, which needs six points at different heights."
        ),
    ] = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")] = Path("calibration.toml"),
    force: ForceOption = False,
    as_json: JsonOption = False,
    example: Annotated[bool, typer.Option("--example", help="Print a TOML of points, and exit.")] = False,
    live: LiveOption = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    token: TokenOption = None,
    size: SizeOption = "1280x720",
    fps: FpsOption = 30.0,
) -> None:
    """Calibrate each camera from points of the room whose places are known, four or more with a lens file.

    States the error to expect, and how far a wrong pixel would go unnoticed.  Exit status 3 when points contradict.

    With --live, a page at http://127.0.0.1:8090 shows the pictures of the cameras, in which the points are placed, and at
    once where each camera is, which point contradicts the others, and what one pixel matters; it writes the file of points
    too: `zenocap calibrate scene points.toml --live left=/dev/video0 right=right.png --lenses lenses.toml`
    """
    if example:
        typer.echo(SCENE_EXAMPLE, nl=False)
        return
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.common.camera.lens_files import read_lenses
    from zenocap.tools.calibration.scene_file import placed_cameras, read_scene, scene_report, scene_verdict

    with one_line_errors():
        if not live:
            file = one_file(points, "give a TOML of points; --example prints one")
        check_new(output, force)
        known = None if lenses is None else read_lenses(lenses)
        if live:
            from zenocap.tools.live.points_scene import ScenePoints

            if as_json:
                raise typer.BadParameter("--json: allowed: without --live")
            path, sources = file_and_cameras(points, "points.toml")
            page, program = (host, port, token), "zenocap calibrate scene --live"
            task = lambda names: ScenePoints(names, path, output, known)  # noqa: E731
            raise typer.Exit(run_points(sources, size, fps, page, program, task, output))
        placed = placed_cameras(read_scene(file), known)
        with writing(output):
            write_calibration(output, {one.camera.name: one.camera for one in placed})
    word, reasons = scene_verdict(placed)
    if as_json:
        cameras = [
            {
                "name": one.camera.name,
                "position_m": one.camera.centre.tolist(),
                "focal_px": float(one.camera.matrix[0, 0]),
                "residuals_px": dict(zip(one.points, one.residuals_px.tolist(), strict=True)),
                "expected_error_m": one.error_m,
                "remarks": list(one.remarks),
            }
            for one in placed
        ]
        typer.echo(json.dumps({"verdict": word, "reasons": reasons, "cameras": cameras, "written": str(output)}, indent=2))
    else:
        report = [line for one in placed for line in scene_report(one)]
        typer.echo("\n".join([*report, f"written: {output}"]))
        typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
    if word == "poor":
        raise typer.Exit(POOR)
