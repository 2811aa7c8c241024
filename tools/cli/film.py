"""The command that records the videos of a rig's cameras: film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.calibrate.board_options import BoardArguments, OptionalSquareOption, board_words
from zenocap.tools.cli.options import DONE, FAILED, LOSS, one_line_errors, rig_at
from zenocap.tools.service_arguments import ZenohArguments


def film(
    rig: Annotated[
        list[str],
        typer.Argument(
            metavar="RIG | NAME=SOURCE...",
            help="Rig file (TOML) with cameras or streams; or the cameras themselves, before they are calibrated; SOURCE "
            "also discover:MACHINE/CAMERA.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write, for `zenocap track`.", show_default=False),
    ],
    seconds: Annotated[
        float | None,
        typer.Option(min=0.1, max=86400, help="Length of the film (s); default: until Ctrl-C.", show_default=False),
    ] = None,
    size: Annotated[
        str, typer.Option(metavar="WxH", help="Size of the images (px) of NAME=SOURCE; a rig's is that of its calibration.")
    ] = "1280x720",
    fps: Annotated[float, typer.Option(min=1.0, max=240.0, help="Frames/s of NAME=SOURCE; a rig has its own.")] = 30.0,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier film in that folder.")] = False,
    fetch: Annotated[
        bool,
        typer.Option(
            "--fetch", help="Copy the videos of other machines here; without it they stay there, and the output says where."
        ),
    ] = False,
    square: OptionalSquareOption = None,
    *,
    board_options: BoardArguments,
    zenoh: ZenohArguments,
) -> None:
    """Record the videos of all cameras and streams of a rig, of all its machines, into a folder for `zenocap track`.

    Cameras of viewers that are running (with `film = true` in the rig file), and of other machines on which `zenocap viewer
    --discover` runs, are filmed by them, on their machine; all others are opened here. A rig that is running goes on. All
    cameras begin together, when each has given its first image and its exposure is fixed, and end together. Images are not
    reduced; every frame keeps its capture time, from which `track` pairs them; differences of the machines' clocks are
    measured and corrected. It ends by itself before the disk is full. Where the rig's backgrounds are `first:N`, leave the
    scene empty at the beginning for that many frames.

    Exit status 3: frames were lost, a camera or machine failed, a video could not be copied, or the film ended early; what
    was filmed can be used.

    Example: `zenocap film studio.toml -o monday --seconds 60`, then `zenocap track monday -o monday.mcap`

    To film the board before there is a calibration: `zenocap film left=/dev/video0 right=/dev/video2 -o films`, then
    `zenocap calibrate board films --square 35`. With --square here too, films stay on the machines of their cameras: the
    board is searched there, and only its corners are copied.
    """
    with one_line_errors():
        from contextlib import ExitStack

        from zenocap.common.bus.access import OPERATOR
        from zenocap.common.errors import UserError
        from zenocap.common.rig.folder import CORNERS, CORNERS_SUFFIX
        from zenocap.common.rig.sources import Announced
        from zenocap.common.runtime.foreign_text import MAX_LINE, printable
        from zenocap.common.runtime.signals import stop_signals
        from zenocap.tools.cli.track import parsed_size
        from zenocap.tools.film.away import copy_commands, detect_commands, write_away
        from zenocap.tools.film.collect import check_fetch, collected
        from zenocap.tools.film.film import film as run_film
        from zenocap.tools.film.film import filmed_viewers
        from zenocap.tools.film.layout import late_texts, prepare, write_layout
        from zenocap.tools.film.remote_film import NOBODY, RemoteFilm
        from zenocap.tools.film.rig_film import cameras_of
        from zenocap.tools.film.sources import named_sources

        board = board_options.film_board(square)
        if board is not None and fetch:
            raise UserError("--square and --fetch: allowed: one of both, corners or videos")
        calibrated = len(rig) == 1 and ("=" not in rig[0] or Path(rig[0]).exists())
        with ExitStack() as network:
            remote: RemoteFilm = NOBODY
            if calibrated:
                loaded = rig_at(Path(rig[0]), files=False)
                viewers = filmed_viewers(loaded)
                for viewer in loaded.viewers:
                    if viewer not in viewers:
                        typer.echo(f"note: viewer {viewer.id}: not a camera or stream: not filmed", err=True)
                prepare(output, viewers, force, calibrated=True)
                options = zenoh.options(loaded, OPERATOR)
                name = output.resolve().name
                own, remote = network.enter_context(cameras_of(loaded, viewers, options, name, _note))
                if fetch:
                    check_fetch(remote)
            else:
                own = viewers = named_sources(rig, parsed_size(size), fps)
                prepare(output, viewers, force, calibrated=False)
                if any(isinstance(viewer.source, Announced) for viewer in viewers):
                    name = output.resolve().name
                    own, remote = network.enter_context(cameras_of(None, viewers, zenoh.options(), name, _note))
                    if fetch:
                        check_fetch(remote)
            with stop_signals() as stopped:
                filmed, reason = run_film(own, output, seconds, stopped, _print, remote=remote)
            if not any(one.frames for one in filmed):
                _note(f"error: nothing was filmed{f': {reason}' if reason else ''}")
                raise typer.Exit(FAILED)
            write_layout(output, viewers, filmed, calibrated=calibrated, begins_empty=not remote.of_running_rig)
            places, failures = collected(remote, output, fetch=fetch, report=_print, board=board)
    good = not reason and not failures
    for one in filmed:
        losses = [f"{one.lost} frames lost by the writer"] * bool(one.lost) + [f"lost and opened again: {one.away}"] * bool(
            one.away
        )
        losses += ["no frame"] * (not one.frames)
        texts = "".join(f", {text}" for text in (*losses, *places.get(one.name, ())))
        _print(f"{one.name}: {one.frames} frames, {one.rate:.2f} frames/s{texts}")
        good = good and not losses
    for text in failures:
        _note(text)
    for text in late_texts(viewers, filmed):
        _note(f"warning: {text}")
    if remote.cameras:
        _print(remote.start_text(filmed))
    if remote.of_running_rig:
        _note("note: of a running rig, so without empty_frames: the background is the median of each video")
    if reason:
        _note(f"ended early: {reason}")
    away = {
        one.name: (printable(one.reply.host), printable(one.reply.folder, MAX_LINE))
        for one in remote.cameras
        if one.reply.frames and not (output / f"videos/{one.name}.mkv").exists()
    }
    with one_line_errors():
        write_away(output, away)
    found = {name for name in away if board is not None and (output / CORNERS / f"{name}{CORNERS_SUFFIX}").exists()}
    missing = {name: place for name, place in away.items() if name not in found}
    described = "--square MM" if board is None else " ".join(board_words(board))
    if missing:
        names = ", ".join(missing)
        if calibrated and board is None:
            copy = f"next: copy videos/ and times/ of {names} into {output}, then zenocap track {output}"
        else:
            _print(
                f"next: detect the board of {names} where the videos are, and copy the corners into {output}, then "
                f"zenocap calibrate board {output} {described}"
            )
            for command in detect_commands(output, missing, described):
                _print(f"  {command}")
            copy = "or copy the videos:"
        _print(copy)
        for command in copy_commands(output, missing):
            _print(f"  {command}")
    elif calibrated and board is None:
        typer.echo(f"next: zenocap track {output} -o {output.resolve().name}.mcap")
    else:
        typer.echo(f"next: zenocap calibrate board {output} {described}")
    raise typer.Exit(DONE if good else LOSS)


def _print(line: str, err: bool = False) -> None:
    """Names come from other machines."""
    from zenocap.common.runtime.foreign_text import MAX_LINE, printable

    typer.echo(printable(line, MAX_LINE), err=err)


def _note(line: str) -> None:
    _print(line, err=True)
