"""The command that draws a take: render."""

from __future__ import annotations

import re
from math import radians
from typing import Annotated, Literal

import typer

from zenocap.tools.cli.frame_range import FrameRange
from zenocap.tools.cli.options import (
    DONE,
    LOSS,
    OutputOption,
    RawOption,
    RemoteOption,
    TakePath,
    one_line_errors,
    smoothing,
)
from zenocap.tools.cli.progress import progress

CAMERA, PICTURE = "Camera", "Picture"
MIN_SIZE_PX, MAX_SIZE_PX = 64, 8192


def render(
    take: TakePath,
    output: OutputOption,
    view: Annotated[
        str,
        typer.Option(
            metavar="VIEW",
            help="front, back, left, right, quarter, top, or the id of a viewer for the view of its camera.",
            rich_help_panel=CAMERA,
        ),
    ] = "quarter",
    follow: Annotated[
        bool, typer.Option("--follow", help="Move the camera with the person.", rich_help_panel=CAMERA)
    ] = False,
    turn: Annotated[
        float,
        typer.Option(
            min=-360, max=360, metavar="DEG", help="Turn of the camera around the scene (deg/s).", rich_help_panel=CAMERA
        ),
    ] = 0.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Width and height (px).", rich_help_panel=PICTURE)] = "1280x720",
    fps: Annotated[
        float | None,
        typer.Option(min=0.1, max=240, help="Frame rate of the film; default: that of the take.", rich_help_panel=PICTURE),
    ] = None,
    theme: Annotated[
        Literal["light", "dark"], typer.Option(help="Colours of floor and background.", rich_help_panel=PICTURE)
    ] = "light",
    poses: Annotated[
        int,
        typer.Option(
            min=1, max=100, help="Number of poses in one picture, evenly spaced in time.", rich_help_panel=PICTURE
        ),
    ] = 1,
    trails: Annotated[
        float,
        typer.Option(
            min=0, max=60, metavar="SECONDS", help="Length of the trails of hands and feet (s).", rich_help_panel=PICTURE
        ),
    ] = 0.0,
    no_captions: Annotated[
        bool, typer.Option("--no-captions", help="Leave out title, time and posture.", rich_help_panel=PICTURE)
    ] = False,
    codec: Annotated[
        Literal["h264", "vp9", "mpeg4"] | None,
        typer.Option(help="Of a film; default: h264 in .mp4, vp9 in .webm. mpeg4: old players.", rich_help_panel=PICTURE),
    ] = None,
    smooth: Annotated[
        str, typer.Option(metavar="HZ|off", help="Cut-off frequency of a Butterworth filter (Hz), such as 6; or off.")
    ] = "off",
    raw: RawOption = False,
    remote: RemoteOption = False,
    *,
    frames: FrameRange,
) -> None:
    """Draw the poses of a take as a film (.mp4, .webm, .webp) or a picture (.png, .jpg). Needs no rig, network or screen.

    A picture shows the first pose, or with --poses several together. The first use compiles the drawing functions, which
    takes about 10 s. Exit status 3: drawn, but a part of the take is missing.

    Example: `zenocap render walk.mcap -o walk.mp4 --follow --trails 1`
    """
    picture_size = parse_size(size)
    first, last = frames.bounds()
    cutoff_hz = smoothing("--smooth", smooth)
    with one_line_errors():
        from zenocap.services.animator.render.camera_path import Shot
        from zenocap.services.animator.render.film import RenderOptions
        from zenocap.services.animator.render.film import render as render_take

        shot = Shot(view, follow, radians(turn))
        options = RenderOptions(
            first, last, fps, picture_size, shot, theme, poses, trails, not no_captions, codec, cutoff_hz, raw
        )
        with progress("drawing", "pictures", remote=remote) as state:
            rendered = render_take(take, output, options, state.update)
    lost = f", {rendered.lost} of them without a person" if rendered.lost else ""
    typer.echo(f"{output}: {rendered.pictures} picture{'s' if rendered.pictures > 1 else ''}{lost}")
    if rendered.cut:
        typer.echo(f"lost: {rendered.cut}", err=True)
    raise typer.Exit(LOSS if rendered.cut else DONE)


def parse_size(text: str) -> tuple[int, int]:
    """Parse WIDTHxHEIGHT, px; both even, as films need them.  Raises typer.BadParameter."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    sides = tuple(int(side) for side in found.groups()) if found else ()
    if len(sides) != 2 or not all(MIN_SIZE_PX <= side <= MAX_SIZE_PX and side % 2 == 0 for side in sides):
        allowed = f"allowed: WIDTHxHEIGHT, both even, from {MIN_SIZE_PX} to {MAX_SIZE_PX}, such as 1280x720"
        raise typer.BadParameter(f"--size {text!r}: {allowed}")
    return sides[0], sides[1]
