"""Live page of `zenocap calibrate scene` and `lines`: points placed in the cameras' pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.calibrate.output import finish
from zenocap.tools.cli.live_page import ImageArguments, PageArguments, run_page
from zenocap.tools.cli.options import FAILED

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.setup.page.camera import LiveCamera
    from zenocap.tools.setup.page.page import PageMode
    from zenocap.tools.setup.page.points_task import PointsTask

FileAndCameras = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[FILE] [CAMERA...]",
        help="TOML, as --example prints one.  With --live it need not exist yet, and the page writes it, without its "
        "comments; after it the cameras: a rig file, NAME=SOURCE, where SOURCE may be a camera, stream, video or picture, "
        "or a folder of videos or pictures; default: all cameras of this machine.",
    ),
]
LiveOption = Annotated[
    bool, typer.Option("--live", help="Place the points with mouse, finger or keys in pictures of the cameras, on a page.")
]


def one_file(texts: Sequence[str] | None, missing: str) -> Path:
    """The file of a command without --live.  Raises typer.BadParameter."""
    if not texts:
        raise typer.BadParameter(missing)
    if len(texts) > 1:
        raise typer.BadParameter(f"{texts[1]}: cameras: allowed: with --live")
    return Path(texts[0])


def file_and_cameras(texts: Sequence[str] | None, default: str) -> tuple[Path, list[str]]:
    """The file of a page, and the sources of its cameras as `run_page` takes them.  Raises UserError."""
    found = list(texts or [])
    own = bool(found) and "=" not in found[0] and not Path(found[0]).is_dir()
    path = Path(found.pop(0)) if own else Path(default)
    if path.suffix.lower() != ".toml":
        raise UserError(f"{path}: allowed: a .toml file, which the page writes; then the cameras, NAME=SOURCE")
    return path, [source for text in found for source in _expanded(text)]


def _expanded(text: str) -> list[str]:
    """The videos or pictures of a folder as NAME=SOURCE; any other text as it is.  Raises UserError."""
    from zenocap.common.rig.folder import IMAGE_SUFFIXES, with_suffix
    from zenocap.common.rig.sources import VIDEO_SUFFIXES

    folder = Path(text)
    if "=" in text or not folder.is_dir():
        return [text]
    for place in (folder / "videos", folder):
        if found := with_suffix(place, VIDEO_SUFFIXES + IMAGE_SUFFIXES):
            return [f"{one.stem}={one}" for one in found]
    raise UserError(f"{folder}: no videos and no pictures in it: allowed: {', '.join(VIDEO_SUFFIXES + IMAGE_SUFFIXES)}")


def run_points(
    sources: Sequence[str], images: ImageArguments, page: PageArguments, program: str,
    make_task: Callable[[list[str]], PointsTask], output: Path,
) -> NoReturn:  # fmt: skip
    """Serve the page until Finish, and end the command, with status FAILED when nothing was saved.  Raises UserError.

    make_task: of the names of the cameras.
    """
    from zenocap.tools.setup.page.points_mode import PointsMode

    def make(cameras: Sequence[LiveCamera], epoch_ns: int) -> PageMode:
        return PointsMode(cameras, make_task([camera.name for camera in cameras]))

    mode = run_page(sources, images, page.table(), program, make, loop=False)
    assert isinstance(mode, PointsMode)
    mode.close()
    if mode.solution is None:
        typer.echo("nothing was saved", err=True)
        raise typer.Exit(FAILED)
    solution = mode.solution
    finish(output, [*solution.report, f"written: {', '.join(mode.written)}"], (solution.verdict, solution.reasons))
