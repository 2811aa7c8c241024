"""Options and run of the commands with a live page of cameras."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import parsed_size, rig_at
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.animator import PageTable
    from zenocap.tools.setup.page.camera import LiveCamera
    from zenocap.tools.setup.page.page import PageMode

DEFAULT_PORT = 8090  # beside 8080 of the rig's page

FpsOption = Annotated[
    float, typer.Option(min=1.0, max=240.0, help="With --live: frames/s that are requested; a rig file has its own.")
]


@dataclass(frozen=True)
class PageArguments:
    """Address of the page of --live."""

    host: str = option("127.0.0.1", "With --live: address of the page on this machine.")
    port: int | None = option(
        None, f"With --live: port, 0 for any free one; default: {DEFAULT_PORT} or a free one.", min=0, max=65535
    )
    token: str | None = option(
        None, "With --live: access token; required with a --host that other machines can reach. `new` generates one."
    )

    def table(self) -> PageTable:
        """Raises UserError."""
        return page_table(self.host, self.port, self.token)


@dataclass(frozen=True)
class ImageArguments:
    """Images that are requested of cameras without a rig file."""

    size: str = option(
        "1280x720", "With --live: size of the images (px) that is requested; a rig file has its own.", metavar="WxH"
    )
    fps: FpsOption = 30.0


def page_table(host: str, port: int | None, token: str | None) -> PageTable:
    """Address of the page.  Raises UserError."""
    from secrets import token_urlsafe

    import msgspec

    from zenocap.common.rig.animator import PageTable, open_page_problem
    from zenocap.tools.cli.show import usual_port

    token = token_urlsafe(24) if token == "new" else token
    try:
        table = msgspec.convert({"host": host, "port": usual_port(port, DEFAULT_PORT), "token": token}, PageTable)
    except msgspec.ValidationError as error:
        raise UserError(f"page: {error}; a token has 16 to 128 letters, digits, '-' and '_'") from error
    if (problem := open_page_problem(table)) is not None:
        raise UserError(f"--host {host}: {problem.replace('page.token', '--token')}")
    return table


def run_page(
    texts: Sequence[str], images: ImageArguments, table: PageTable, program: str,
    make_mode: Callable[[Sequence[LiveCamera], int], PageMode], *, loop: bool = True,
) -> PageMode:  # fmt: skip
    """Open the cameras and serve their page until Ctrl-C or the end of the mode, which is returned.  Raises UserError.

    texts: a rig file, or NAME=SOURCE; none for all cameras.  loop: whether video files are repeated.
    make_mode: of the cameras, and the capture time of the first frame of files, ns.
    """
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.setup.page.camera import LiveCamera, first_epoch_ns, stop_all
    from zenocap.tools.setup.page.page import LivePage, wait_for_images
    from zenocap.tools.setup.page.parameters import FILE_DELAY_S
    from zenocap.tools.setup.page.sources import live_viewers

    logs.configure("cameras")
    viewers, notes = live_viewers(texts, parsed_size(images.size), images.fps, lambda path: rig_at(Path(path), files=False))
    for note in notes:
        typer.echo(note, err=True)
    epoch_ns = first_epoch_ns(FILE_DELAY_S)
    cameras = [LiveCamera(viewer, epoch_ns, loop=loop) for viewer in viewers]
    mode = make_mode(cameras, epoch_ns)
    page = LivePage(cameras, table, program, mode)
    with stop_signals() as stopped:
        try:
            page.open()
            for camera in cameras:
                camera.start()
            wait_for_images(cameras, stopped)
            if not stopped():
                typer.echo(f"{len(cameras)} cameras: open {page.address} in a browser; Ctrl-C ends")
            page.run(stopped)
        finally:
            stop_all(cameras)
            page.close()
    return mode
