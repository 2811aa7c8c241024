"""The command that draws a take: render."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import (
    DONE,
    LOSS,
    FrameRange,
    OutputOption,
    RawOption,
    RemoteOption,
    TakePath,
    one_line_errors,
    size_of,
    smoothing,
)
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.takes.render.film import RenderOptions

MIN_SIZE_PX, MAX_SIZE_PX = 64, 8192


@dataclass(frozen=True)
class RenderArguments:
    """view: of a name, or of a camera."""

    view: str = option(
        "quarter",
        "front, back, left, right, quarter, top, or the id of a viewer for the view of its camera.",
        metavar="VIEW",
    )
    follow: bool = option(False, "Move the camera with the person.")
    size: str = option("1280x720", "Width and height (px).", metavar="WxH")
    fps: float | None = option(None, "Frame rate of the film; default: that of the take.", min=0.1, max=240)
    theme: Literal["light", "dark"] = option("light", "Colours of floor and background.")


@dataclass(frozen=True)
class RenderExpert:
    """turn: of the camera, deg/s.  trails: s."""

    turn: float = option(0.0, "Turn of the camera around the scene (deg/s).", min=-360, max=360, metavar="DEG")
    poses: int = option(1, "Number of poses in one picture, evenly spaced in time.", min=1, max=100)
    trails: float = option(0.0, "Length of the trails of hands and feet (s).", min=0, max=60, metavar="SECONDS")
    no_captions: bool = option(False, "Leave out title, time and posture.")
    codec: Literal["h264", "vp9", "mpeg4"] | None = option(
        None, "Of a film; default: h264 in .mp4, vp9 in .webm. mpeg4: old players."
    )
    smooth: str = option("off", "Cut-off frequency of a Butterworth filter (Hz), such as 6; or off.", metavar="HZ|off")
    raw: RawOption = False
    remote: RemoteOption = False


def render(
    take: TakePath, output: OutputOption, *, given: RenderArguments, frames: FrameRange,
    expert: Annotated[RenderExpert, EXPERT],
) -> None:  # fmt: skip
    """Draw the poses of a take as a film or a picture.

    A film is .mp4, .webm or .webp, a picture .png or .jpg. Needs no rig, network or screen. A picture shows the first
    pose, or with --poses several together. The first use compiles the drawing functions, which takes about 10 s. Exit
    status 3: drawn, but a part of the take is missing.

    Example: `zenocap render walk.mcap -o walk.mp4 --follow --trails 1`
    """
    options = _options(given, frames, expert)
    with one_line_errors():
        from zenocap.tools.takes.render.film import render as render_take

        with progress("drawing", "pictures", remote=expert.remote) as state:
            rendered = render_take(take, output, options, state.update)
    lost = f", {rendered.lost} of them without a person" if rendered.lost else ""
    typer.echo(f"{output}: {rendered.pictures} picture{'s' if rendered.pictures > 1 else ''}{lost}")
    if rendered.cut:
        typer.echo(f"lost: {rendered.cut}", err=True)
    raise typer.Exit(LOSS if rendered.cut else DONE)


def _options(given: RenderArguments, frames: FrameRange, expert: RenderExpert) -> RenderOptions:
    """Raises typer.BadParameter."""
    size = parse_size(given.size)
    first, last = frames.bounds()
    cutoff_hz = smoothing("--smooth", expert.smooth)
    from zenocap.tools.takes.render.camera_path import Shot
    from zenocap.tools.takes.render.film import RenderOptions

    shot = Shot(given.view, given.follow, radians(expert.turn))
    captions = not expert.no_captions
    return RenderOptions(
        first, last, given.fps, size, shot, given.theme, expert.poses, expert.trails, captions, expert.codec, cutoff_hz,
        expert.raw,
    )  # fmt: skip


def parse_size(text: str) -> tuple[int, int]:
    """Parse WIDTHxHEIGHT, px; both even, as films need them.  Raises typer.BadParameter."""
    sides = size_of(text, MIN_SIZE_PX, MAX_SIZE_PX)
    if sides is None or any(side % 2 for side in sides):
        allowed = f"allowed: WIDTHxHEIGHT, both even, from {MIN_SIZE_PX} to {MAX_SIZE_PX}, such as 1280x720"
        raise typer.BadParameter(f"--size {text!r}: {allowed}")
    return sides
