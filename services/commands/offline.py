"""Commands that track and measure offline: track, evaluate, warmup."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from services.commands.options import (
    DONE,
    LOSS,
    JsonOption,
    Method,
    OutputOption,
    RigPath,
    TakePath,
    one_line_errors,
    rig_at,
)

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.runtime.rig import Rig
    from services.takes.overlay import Overlay
    from services.takes.track import Instant

Refinement = Literal["gauss-newton", "force", "force-printed"]
PICTURES = 20  # of an overlay, about
TRACKER = "Tracker (of the methods hybrid, image-force, particle-filter)"


def track(
    rig: RigPath,
    output: OutputOption,
    method: Annotated[
        Method | None,
        typer.Option(
            help="How the pose is found: two-view from two views, the others from all; default: the rig's, else two-view."
        ),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Working size, such as 160x120; default: the rig's.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(min=0.1, max=1000, help="Frames per second that are used; default: the rig's.")
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(
            "--height",
            min=0.5,
            max=2.5,
            metavar="METRES",
            help="The person's height, where no initial posture is shown: the body then has average proportions.",
        ),
    ] = None,
    prior: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="What the tracker knows of motion.", rich_help_panel=TRACKER),
    ] = None,
    particles: Annotated[
        int | None,
        typer.Option(min=1, max=20_000, help="Default: 40; particle-filter 1000.", rich_help_panel=TRACKER),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(min=20, max=10_000, help="Of the visual hull; default: 400.", rich_help_panel=TRACKER),
    ] = None,
    iterations: Annotated[
        int | None,
        typer.Option(min=0, max=100, help="Of the refinement; default: 4, of forces 40.", rich_help_panel=TRACKER),
    ] = None,
    refinement: Annotated[
        Refinement | None,
        typer.Option(
            help="Least squares, or the paper's forces and moments, corrected or as printed; default: by method.",
            rich_help_panel=TRACKER,
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Of what is drawn; default: 0.", rich_help_panel=TRACKER)] = None,
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write pictures of the model drawn on the person, and a video.")
    ] = None,
    overlay_every: Annotated[
        int | None, typer.Option(min=1, help="A picture each so many frames; default: about 20 pictures.")
    ] = None,
) -> None:
    """Track every frame of a rig's videos, offline: the same steps as live, without network, the same bytes each time.

    An existing output is replaced. Exit status 3: done, but a video ended early or something was lost.

    Example: `zenocap track clips/walk -o walk.mcap`, then `zenocap export walk.mcap --to trc -o walk.trc`

    With three or more cameras: `zenocap track clips/walk --method hybrid --prior walking -o walk.mcap`
    """
    wanted = None if size is None else parsed_size(size)
    with one_line_errors():
        from common.runtime import logs
        from common.runtime.tracker_table import Wanted
        from services.takes.track import at_working_size, of_height, with_tracker
        from services.takes.track import track as run_track

        logs.configure("track")
        one = at_working_size(rig_at(rig, files=True, method=method), wanted, fps)
        one = with_tracker(one, Wanted(prior, particles, points, iterations, refinement, seed))
        if height is not None:
            one = of_height(one, height)
        for note in one.notes:
            typer.echo(f"note: {note}", err=True)
        expected = expected_instants(one)
        drawing = None if overlay is None else _overlay(one, overlay, overlay_every, expected)
        with _progress(expected, () if drawing is None else (drawing.see,)) as watch:
            result = run_track(one, output, watch)
    typer.echo(f"{output}: {result.instants} frames, {result.poses} poses, {result.messages} messages")
    if drawing is not None:
        typer.echo(f"{overlay}: {drawing.finish()} pictures and overlay.mp4")
    for problem in result.problems:
        typer.echo(f"lost: {problem}", err=True)
    if not result.poses:
        typer.echo("no pose: the body is measured when all viewers see the initial posture, arms sideways;", err=True)
        typer.echo("  where it is not shown, give --height.  At the end:", err=True)
        for service, state in result.states.items():
            typer.echo(f"  {service}: {state}", err=True)
    raise typer.Exit(LOSS if result.problems or not result.poses else DONE)


def evaluate(
    take: TakePath,
    truth: Annotated[Path, typer.Option(metavar="FILE.trc", help="The true joint centres.", show_default=False)],
    first: Annotated[int | None, typer.Option("--from", help="First frame of the truth.", show_default=False)] = None,
    last: Annotated[int | None, typer.Option("--to", help="Last frame of the truth.", show_default=False)] = None,
    every: Annotated[int, typer.Option(min=1, help="Score each Nth frame, for a take at 1/N of the rate.")] = 1,
    offset: Annotated[int, typer.Option(help="Frame of the take minus frame of the truth.")] = 0,
    as_json: JsonOption = False,
) -> None:
    """How far a take's joint centres are from the truth: mean and RMS distance, shape error, share of lost ones.

    shape_mm is the RMS distance after each joint's constant offset in its own body is taken off, because two bodies do
    not define their joints alike. Lost is what has no estimate or is more than 250 mm away.

    Example: `zenocap evaluate walk.mcap --truth clips/walk/truth.trc --from 99`
    """
    with one_line_errors():
        from common.formats.poses import read_poses
        from common.formats.trc import read_trc
        from services.takes.evaluate import Selection, accuracy

        poses = read_poses(take)
        found = accuracy(poses.trajectories(), read_trc(truth), Selection(first, last, every, offset))
    if as_json:
        typer.echo(json.dumps(asdict(found)))
    else:
        for name in ("frames", "joints"):
            typer.echo(f"{name:10} {getattr(found, name)}")
        for name in ("mpjpe_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct"):
            typer.echo(f"{name:10} {getattr(found, name):.2f}")
        typer.echo("joints mm  " + "  ".join(f"{name} {value:.0f}" for name, value in found.per_joint_mm.items()))
    if poses.cut:
        typer.echo(f"lost: {poses.cut}", err=True)
    raise typer.Exit(LOSS if poses.cut else DONE)


def warmup(part: Annotated[list[str] | None, typer.Option(hidden=True)] = None) -> None:
    """Compile everything that is compiled on first use, so that the next start is quick.

    demo and up do it by themselves; do it before a take where a late start matters. Takes some 20 s once.

    Example: `zenocap warmup`
    """
    from services.warmup import PARTS, warm_up

    for one in part or PARTS:
        if not part:
            typer.echo(f"compiling: {one} ...", err=True)
        warm_up(one)


def parsed_size(text: str) -> tuple[int, int]:
    """(width, height) of "160x120".  Raises typer.BadParameter."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not found or min(int(found[1]), int(found[2])) < 16:
        raise typer.BadParameter(f"--size {text!r}: allowed: WIDTHxHEIGHT of 16 px or more, such as 160x120")
    return int(found[1]), int(found[2])


def expected_instants(rig: Rig) -> int | None:
    """About how many instants a rig's files have; None when it cannot be told."""
    from services.viewer.source import frame_count

    counts = [count for count in map(frame_count, rig.viewers) if count]
    return max(counts) if counts else None


def _overlay(rig: Rig, folder: Path, every: int | None, expected: int | None) -> Overlay:
    from services.takes.overlay import Overlay

    return Overlay(rig, folder, every or max(1, (expected or PICTURES) // PICTURES))


@contextmanager
def _progress(expected: int | None, watchers: tuple[Callable[[Instant], None], ...]) -> Iterator[Callable[[Instant], None]]:
    """A bar on standard error, moved by each instant, which goes on to the watchers."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("tracking (the first run compiles for some 20 s)", total=expected)

        def watch(instant: Instant) -> None:
            for watcher in watchers:
                watcher(instant)
            rate = progress.tasks[0].speed
            progress.update(task, advance=1, description=(f"{rate:.1f}/s  " if rate else "") + instant.state)

        yield watch
