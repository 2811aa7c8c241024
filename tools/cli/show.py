"""The command that shows a take on the page: show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import RawOption, one_line_errors
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.services.animator.comparison import TakeComparison

DEFAULT_PORT = 8080
MAX_OFFSET_S = 86_400.0  # of two compared takes: a day

ShownTake = Annotated[
    Path,
    typer.Argument(
        metavar="TAKE", help="A take: an MCAP file, recorded, or made by `zenocap track`; or the folder that was tracked."
    ),
]


@dataclass(frozen=True)
class ShowArguments:
    """beside: another take, shown `offset` seconds later."""

    videos: Path | None = option(
        None,
        "Folder that was tracked, whose pictures are shown; default: the one of its name beside the take.",
        metavar="FOLDER",
    )
    port: int | None = option(
        None, f"Port of the page, 0 for any free one; default: {DEFAULT_PORT} or a free one.", min=0, max=65535
    )
    beside: Path | None = option(
        None,
        "A second take of the same motion, shown as a translucent figure, with the distances of the joints.",
        metavar="OTHER",
    )
    offset: float = option(
        0.0, "With --beside: show OTHER so much later.", min=-MAX_OFFSET_S, max=MAX_OFFSET_S, metavar="SECONDS"
    )
    raw: RawOption = False


def show(take: ShownTake, *, given: ShowArguments) -> None:
    """Play a take on a page in the browser.

    The page, at http://127.0.0.1:8080, plays it in a loop, until Ctrl-C; no rig is needed. It has the virtual actor,
    the silhouettes, the joint angles and the recognized postures of the take, as far as they were recorded, and
    controls for position and rate. The pictures of the cameras are behind the silhouettes of a take that was tracked
    from a folder. Only this machine can open it.

    With --beside, the poses of OTHER are shown at the same recorded times, or from the first poses on where these do not
    overlap; the page says which. The page opens at once; the second figure appears when both takes are read.

    Example: `zenocap show walk.mcap`
    """
    with one_line_errors():
        from zenocap.common.rig.animator import PageTable
        from zenocap.common.runtime import logs
        from zenocap.common.runtime.signals import stop_signals
        from zenocap.services.animator.show import show_take
        from zenocap.tools.takes.take_videos import take_of, videos_of

        if given.offset and given.beside is None:
            raise UserError(
                f"--offset {given.offset:g}: it moves a second take: allowed: only together with --beside OTHER"
            )
        logs.configure("show")
        shown, take = take, take_of(take)
        pictures = videos_of(take, given.videos, shown)
        compared = None if given.beside is None else _comparison(take, given.beside, given)
        with stop_signals() as stopped:
            show_take(
                take, PageTable(port=usual_port(given.port, DEFAULT_PORT)), stopped,
                lambda url: typer.echo(f"{take.name}: open {url} in a browser; Ctrl-C ends"),
                None if pictures is None else pictures.at, raw=given.raw, compared=compared,
            )  # fmt: skip


def _comparison(take: Path, beside: Path, given: ShowArguments) -> Callable[[Callable[[], bool]], TakeComparison]:
    """Function that reads both takes, until its argument is true.  Raises UserError."""
    from zenocap.services.animator.comparison_reader import compare
    from zenocap.services.animator.show import check_take
    from zenocap.tools.takes.take_videos import take_of

    other = take_of(beside)
    check_take(other)
    return lambda stopped: compare(take, other, given.offset, raw=given.raw, stopped=stopped)


def usual_port(port: int | None, usual: int) -> int:
    """The port, or else the usual one if the loopback interface can listen on it, or else any free one: 0."""
    import socket

    if port is not None:
        return port
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", usual))
        except OSError:
            return 0
    return usual
