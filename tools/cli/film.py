"""The command that records the videos of a rig's cameras: film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.options import DONE, FAILED, LOSS, one_line_errors, rig_at


def film(
    rig: Annotated[
        Path, typer.Argument(metavar="RIG", help="Rig file (TOML) with cameras or streams.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write, for `zenocap track`.", show_default=False),
    ],
    seconds: Annotated[
        float | None,
        typer.Option(min=0.1, max=86400, help="Length of the film (s); default: until Ctrl-C.", show_default=False),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier film in that folder.")] = False,
) -> None:
    """Record the videos of all cameras and streams of a rig that this machine reaches, into a folder for `zenocap track`.

    The rig itself must not run: a camera gives images to one program. All cameras begin together, when each has given its
    first image and its exposure is fixed, and end together. Images are not reduced; every frame keeps its capture time,
    from which `track` pairs them. It ends by itself before the disk is full. Where the rig's backgrounds are `first:N`,
    leave the scene empty at the beginning for that many frames.

    Exit status 3: frames were lost, a camera failed for a time, or the film ended early; what was filmed can be used.

    Example: `zenocap film studio.toml -o monday --seconds 60`, then `zenocap track monday -o monday.mcap`
    """
    with one_line_errors():
        from zenocap.common.runtime.signals import stop_signals
        from zenocap.tools.film.film import film as run_film
        from zenocap.tools.film.film import filmed_viewers
        from zenocap.tools.film.layout import prepare, write_layout

        loaded = rig_at(rig, files=False)
        viewers = filmed_viewers(loaded)
        prepare(output, viewers, force)
        for viewer in loaded.viewers:
            if viewer not in viewers:
                typer.echo(f"note: viewer {viewer.id}: not a camera or stream: not filmed", err=True)
        with stop_signals() as stopped:
            filmed, reason = run_film(viewers, output, seconds, stopped, typer.echo)
        if not any(one.frames for one in filmed):
            typer.echo(f"error: nothing was filmed{f': {reason}' if reason else ''}", err=True)
            raise typer.Exit(FAILED)
        write_layout(output, viewers, filmed)
    good = not reason
    for one in filmed:
        losses = [f"{one.lost} frames lost by the writer"] * bool(one.lost) + [f"lost and opened again: {one.away}"] * bool(
            one.away
        )
        losses += ["no frame"] * (not one.frames)
        typer.echo(f"{one.name}: {one.frames} frames, {one.rate:.2f} frames/s{''.join(f', {text}' for text in losses)}")
        good = good and not losses
    if reason:
        typer.echo(f"ended early: {reason}", err=True)
    typer.echo(f"next: zenocap track {output} -o {output.resolve().name}.mcap")
    raise typer.Exit(DONE if good else LOSS)
