"""Command calibrate scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from zenocap.tools.cli.calibrate.output import CalibrationOption, ForceOption, check_new, finish, show, write_result
from zenocap.tools.cli.calibrate.points_page import FileAndCameras, LiveOption, file_and_cameras, one_file, run_points
from zenocap.tools.cli.live_page import ImageArguments, PageArguments
from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.camera.lens import Lens

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


@dataclass(frozen=True)
class SceneArguments:
    """lenses: without, the focal lengths are estimated."""

    lenses: Path | None = option(
        None,
        "Lenses of the cameras: any calibration, ROS camera_info, OpenCV, or a folder of these; a single lens is "
        "that of all cameras.  Without: the focal length is estimated, which needs six points at different heights.",
    )
    output: CalibrationOption = Path("calibration.toml")
    force: ForceOption = False
    as_json: JsonOption = False
    example: bool = option(False, "Print a TOML of points, and exit.")
    live: LiveOption = False

    def known(self) -> Mapping[str, Lens] | None:
        """The lenses.  Raises UserError."""
        from zenocap.common.camera.lens_files import read_lenses

        return None if self.lenses is None else read_lenses(self.lenses)


def scene(
    points: FileAndCameras = None, *, given: SceneArguments, images: ImageArguments, page: Annotated[PageArguments, EXPERT]
) -> None:
    """Calibrate each camera from points of the room whose places are known, four or more with a lens file.

    States the error to expect, and how far a wrong pixel would go unnoticed.  Exit status 3 when points contradict.

    With --live, a page at http://127.0.0.1:8090 shows the pictures of the cameras, in which the points are placed, and at
    once where each camera is, which point contradicts the others, and what one pixel matters; it writes the file of points
    too: `zenocap calibrate scene points.toml --live left=/dev/video0 right=right.png --lenses lenses.toml`
    """
    if given.example:
        typer.echo(SCENE_EXAMPLE, nl=False)
        return
    from zenocap.common.camera.calibration_files import write_calibration
    from zenocap.tools.setup.calibration.scene_file import (
        placed_cameras,
        read_scene,
        scene_data,
        scene_report,
        scene_verdict,
    )

    output = given.output
    with one_line_errors():
        if given.live:
            _live(points, given, images, page)
        file = one_file(points, "give a TOML of points; --example prints one")
        check_new(output, given.force)
        placed = placed_cameras(read_scene(file), given.known())
        cameras = {one.camera.name: one.camera for one in placed}
        write_result(output, given.force, lambda path, new: write_calibration(path, cameras, new=new))
    if given.as_json:
        finish(output, (), scene_verdict(placed), scene_data(placed))
    report = [line for one in placed for line in scene_report(one)]
    raise typer.Exit(show([*report, f"written: {output}"], scene_verdict(placed)))


def _live(texts: Sequence[str] | None, given: SceneArguments, images: ImageArguments, page: PageArguments) -> NoReturn:
    """Place the points on a page, and end the command.  Raises UserError, typer.BadParameter."""
    from zenocap.tools.setup.page.points_scene import ScenePointTask

    check_new(given.output, given.force)
    known = given.known()
    if given.as_json:
        raise typer.BadParameter("--json: allowed: without --live")
    (path, sources), program = file_and_cameras(texts, "points.toml"), "zenocap calibrate scene --live"
    output, force = given.output, given.force
    run_points(sources, images, page, program, lambda names: ScenePointTask(names, path, output, known, force), output)
