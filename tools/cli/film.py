"""The command that records the videos of a rig's cameras: film."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.calibrate.board_options import BoardArguments, OptionalSquareOption, board_words
from zenocap.tools.cli.options import DONE, LOSS, echo, one_line_errors, parsed_size, rig_at
from zenocap.tools.option_groups import EXPERT, option
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.bus.zenoh_session import ZenohOptions
    from zenocap.common.messages import FilmBoard
    from zenocap.tools.record.film.session import FilmRequest

RigOrCameras = Annotated[
    list[str],
    typer.Argument(
        metavar="RIG | NAME=SOURCE...",
        help="Rig file (TOML) with cameras or streams; or the cameras themselves, before they are calibrated; SOURCE "
        "also discover:MACHINE/CAMERA.",
    ),
]
FolderOption = Annotated[
    Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write, for `zenocap track`.")
]


@dataclass(frozen=True)
class FilmArguments:
    """seconds: None until Ctrl-C.  size, fps: of cameras without a rig."""

    seconds: float | None = option(None, "Length of the film (s); default: until Ctrl-C.", min=0.1, max=86400)
    size: str = option(
        "1280x720", "Size of the images (px) of NAME=SOURCE; a rig's is that of its calibration.", metavar="WxH"
    )
    fps: float = option(30.0, "Frames/s of NAME=SOURCE; a rig has its own.", min=1.0, max=240.0)
    force: bool = option(False, "Replace an earlier film in that folder.")
    fetch: bool = option(
        False, "With certificates: copy the videos of other machines here; else commands that copy them are printed."
    )
    square: OptionalSquareOption = None


def film(
    rig: RigOrCameras, output: FolderOption, *, given: FilmArguments, board_options: Annotated[BoardArguments, EXPERT],
    zenoh: ZenohArguments,
) -> None:  # fmt: skip
    """Record videos of a rig's cameras, for `zenocap track`.

    Films all cameras and streams of a rig, of all its machines, into one folder. Cameras of viewers that are running
    (with `film = true` in the rig file), and of other machines on which `zenocap viewer --discover` runs, are filmed by
    them, on their machine; all others are opened here. A rig that is running goes on. All cameras begin together, when
    each has given its first image and its exposure is fixed, and end together. Images are not reduced; every frame
    keeps its capture time, from which `track` pairs them; differences of the machines' clocks are measured and
    corrected. It ends by itself before the disk is full. Where the rig's backgrounds are `first:N`, leave the scene
    empty at the beginning for that many frames.

    Exit status 3: frames were lost, a camera or machine failed, a video could not be copied, or the film ended early; what
    was filmed can be used.

    Example: `zenocap film studio.toml -o monday --seconds 60`, then `zenocap track monday -o monday.mcap`

    To film the board before there is a calibration: `zenocap film left=/dev/video0 right=/dev/video2 -o films`, then
    `zenocap calibrate board films --square 35`. With --square here too, films stay on the machines of their cameras: the
    board is searched there, and only its corners are copied.
    """
    with one_line_errors():
        from zenocap.tools.record.film.session import lines_of, next_lines, run_film
        from zenocap.tools.setup.cameras.away import write_away

        board = board_options.film_board(given.square)
        if board is not None and given.fetch:
            raise UserError("--square and --fetch: allowed: one of both, corners or videos")
        request, options = _request(rig, output, given, board, zenoh)
        result = run_film(request, options, echo, _note)
        if result.is_empty:
            raise UserError(f"nothing was filmed{f': {result.reason}' if result.reason else ''}")
        for line, is_warning in lines_of(result):
            echo(line, err=is_warning)
        write_away(output, result.away())
        for line in next_lines(result, "--square MM" if board is None else " ".join(board_words(board))):
            echo(line)
    raise typer.Exit(DONE if result.is_whole else LOSS)


def _request(
    texts: Sequence[str], folder: Path, given: FilmArguments, board: FilmBoard | None, zenoh: ZenohArguments
) -> tuple[FilmRequest, ZenohOptions | None]:
    """What is filmed, of a rig or of single cameras, and the network of cameras that other programs have.

    Raises UserError.
    """
    from zenocap.common.bus.access import OPERATOR
    from zenocap.common.rig.sources import Announced
    from zenocap.tools.record.film.film import filmed_viewers
    from zenocap.tools.record.film.session import FilmRequest
    from zenocap.tools.setup.cameras.named_sources import named_sources

    options: ZenohOptions | None = None
    if len(texts) == 1 and ("=" not in texts[0] or Path(texts[0]).exists()):
        loaded = rig_at(Path(texts[0]), files=False)
        viewers = filmed_viewers(loaded)
        for viewer in loaded.viewers:
            if viewer not in viewers:
                typer.echo(f"note: viewer {viewer.id}: not a camera or stream: not filmed", err=True)
        options = zenoh.options(loaded, OPERATOR)
    else:
        loaded, viewers = None, named_sources(texts, parsed_size(given.size), given.fps)
        if any(isinstance(one.source, Announced) for one in viewers):
            options = zenoh.options()
    return FilmRequest(folder, loaded, viewers, given.seconds, given.force, given.fetch, board), options


def _note(line: str) -> None:
    echo(line, err=True)
