"""The options and the work of `zenocap animator TAKE --render FILE`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer

from services.commands.options import DONE, LOSS, one_line_errors
from services.commands.takes import bound

PANEL = "Rendering a take"
LEAST_PX, MOST_PX = 64, 8192

RenderOption = Annotated[
    Path | None,
    typer.Option(
        "--render", metavar="FILE", help="Write a take as a film (.mp4) or a picture (.png, .jpg).", rich_help_panel=PANEL
    ),
]
FromOption = Annotated[
    str | None,
    typer.Option("--from", metavar="FRAME|TIMEs", help="First frame, such as 120, or 2.5s.", rich_help_panel=PANEL),
]
UntilOption = Annotated[
    str | None, typer.Option("--until", metavar="FRAME|TIMEs", help="Last frame, itself included.", rich_help_panel=PANEL)
]
ViewOption = Annotated[
    str,
    typer.Option(
        metavar="VIEW",
        help="front, back, left, right, quarter, top, or a viewer's id: as its camera sees it.",
        rich_help_panel=PANEL,
    ),
]
FollowOption = Annotated[bool, typer.Option("--follow", help="The camera goes with the person.", rich_help_panel=PANEL)]
TurnOption = Annotated[
    float,
    typer.Option(min=-360, max=360, metavar="DEG", help="The camera goes round, degrees a second.", rich_help_panel=PANEL),
]
SizeOption = Annotated[str, typer.Option(metavar="WxH", help="Of the picture.", rich_help_panel=PANEL)]
FpsOption = Annotated[
    float | None, typer.Option(min=0.1, max=240, help="Of the film; default: the take's.", rich_help_panel=PANEL)
]
LookOption = Annotated[Literal["light", "dark"], typer.Option(help="Of floor and backdrop.", rich_help_panel=PANEL)]
PosesOption = Annotated[
    int, typer.Option(min=1, max=100, help="How many a picture shows together, evenly spread.", rich_help_panel=PANEL)
]
TrailsOption = Annotated[
    float,
    typer.Option(min=0, max=60, metavar="SECONDS", help="How long hands and feet leave a trail.", rich_help_panel=PANEL),
]
NoCaptionsOption = Annotated[bool, typer.Option("--no-captions", help="Write nothing on it.", rich_help_panel=PANEL)]
CodecOption = Annotated[
    Literal["vp9", "mpeg4"],
    typer.Option(help="Of a film: vp9 plays in browsers; mpeg4 is written faster.", rich_help_panel=PANEL),
]


def render_take(
    take: Path,
    output: Path,
    first: str | None,
    last: str | None,
    view: str,
    follow: bool,
    turn: float,
    size: str,
    fps: float | None,
    look: Literal["light", "dark"],
    poses: int,
    trails: float,
    no_captions: bool,
    codec: Literal["vp9", "mpeg4"],
) -> None:
    """Write the film or picture and say so; exits with 3 when something of the take is missing."""
    wanted_size = parsed_picture_size(size)
    since, until = bound("--from", first), bound("--until", last)
    with one_line_errors():
        from math import radians

        from services.animator.render.film import Wishes, render
        from services.animator.render.path import Shot

        shot = Shot(view, follow, radians(turn))
        wishes = Wishes(since, until, fps, wanted_size, shot, look, poses, trails, not no_captions, codec)
        with _progress() as watch:
            rendered = render(take, output, wishes, watch)
    lost = f", {rendered.lost} of them without the person" if rendered.lost else ""
    typer.echo(f"{output}: {rendered.pictures} picture{'s' if rendered.pictures > 1 else ''}{lost}")
    if rendered.cut:
        typer.echo(f"lost: {rendered.cut}", err=True)
    raise typer.Exit(LOSS if rendered.cut else DONE)


def parsed_picture_size(text: str) -> tuple[int, int]:
    """(width, height) px, even, as films need it.  Raises typer.BadParameter."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    sides = tuple(int(side) for side in found.groups()) if found else ()
    if len(sides) != 2 or not all(LEAST_PX <= side <= MOST_PX and side % 2 == 0 for side in sides):
        allowed = f"allowed: WIDTHxHEIGHT, both even, from {LEAST_PX} to {MOST_PX}, such as 1280x720"
        raise typer.BadParameter(f"--size {text!r}: {allowed}")
    return sides[0], sides[1]


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error, on a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("drawing (the first run compiles for some 10 s)", total=None)
        yield lambda done, of: progress.update(task, completed=done, total=of, description="drawing")
