"""Commands that work on takes: info, export, recover."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from services.commands.options import DONE, LOSS, JsonOption, OutputOption, TakePath, one_line_errors

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.formats.track import Bound

SLOW_S = 2.0


def export(
    take: TakePath,
    to: Annotated[
        Literal["trc", "bvh", "c3d", "csv"],
        typer.Option(help="trc, c3d: joint centres. bvh: a skeleton that moves. csv: angles, scores and joint centres."),
    ],
    output: OutputOption,
    first: Annotated[
        str | None, typer.Option("--from", metavar="FRAME|TIMEs", help="First frame, such as 120, or 2.5s.")
    ] = None,
    last: Annotated[str | None, typer.Option("--until", metavar="FRAME|TIMEs", help="Last frame, itself included.")] = None,
    fps: Annotated[
        float | None, typer.Option(min=0.1, max=1000, help="Resample to this rate; default: the frames of the take.")
    ] = None,
    axes: Annotated[
        Literal["y-up", "z-up", "ros", "opensim", "unity", "unreal"], typer.Option(help="Axes of the world, see below.")
    ] = "y-up",
    units: Annotated[
        Literal["m", "cm", "mm"] | None, typer.Option(help="Default: m in trc and csv, cm in bvh, mm in c3d.")
    ] = None,
    angles: Annotated[Literal["deg", "rad"], typer.Option(help="Of the joint angles in csv.")] = "deg",
) -> None:
    """Write the poses of a take for other programs; the file appears whole or not at all.

    trc: OpenSim and Pose2Sim, HALPE names. c3d: the same points. bvh: Blender and others, rest pose with the arms
    sideways. csv: one row per frame. Frame k of a video is frame k of every file: in bvh and c3d rows count from frame
    0, or from --from. Where the person is lost a row is blank, and bvh holds the last pose.

    --fps puts rows at exact multiples of 1/fps s, positions in straight lines, every joint along its shortest turn, and
    nothing across gaps of more than 0.25 s. (--to is the format, so the end of a range is --until.)

    --axes: y-up, as recorded, the person first facing Z. z-up: Blender, FreeMoCap; facing -Y. ros: Z up, facing X.
    opensim: Y up, facing X. unity: left-handed, Y up, facing Z. unreal: left-handed, Z up, facing X.

    Example: `zenocap export walk.mcap --to bvh -o walk.bvh --fps 30 --from 2s`
    """
    start, end = bound("--from", first), bound("--until", last)
    with one_line_errors(), _told_when_slow(f"reading {take} ..."):
        from services.takes.export import Wanted
        from services.takes.export import export as run_export

        written = run_export(take, output, Wanted(to, start, end, fps, axes, units, angles))
    typer.echo(
        f"{output}: {written.rows} frames, {written.first} to {written.last}, {written.rate:.5g}/s, {written.unit}, {axes}"
    )
    if written.empty:
        typer.echo(f"note: {written.empty} frames without pose: {'the last is held' if to == 'bvh' else 'blank'}", err=True)
    if written.cut:
        typer.echo(f"lost: {written.cut}", err=True)
    raise typer.Exit(LOSS if written.cut else DONE)


def bound(option: str, text: str | None) -> Bound | None:
    """A frame number, or a time with "s".  Raises typer.BadParameter."""
    from common.formats.track import Bound

    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,12})|(\d{1,9}(?:\.\d{0,9})?)s", text)
    if not found:
        raise typer.BadParameter(f"{option} {text!r}: allowed: a frame number such as 120, or seconds such as 2.5s")
    return Bound(float(found[1]) if found[1] else float(found[2]), found[1] is None)


@contextmanager
def _told_when_slow(words: str) -> Iterator[None]:
    """Say on a terminal what is going on, when it takes more than two seconds."""
    from threading import Timer

    from rich.console import Console

    console = Console(stderr=True)
    status = console.status(words)
    timer = Timer(SLOW_S, status.start)
    if console.is_terminal:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
        status.stop()


def info(take: TakePath, as_json: JsonOption = False) -> None:
    """What is in a take: channels with rates and gaps, frames that are missing, pairs, health, versions, files.

    Of a cut or damaged take everything that is whole; then exit status 3.

    Example: `zenocap info recordings/demo.mcap`
    """
    with one_line_errors(), _told_when_slow(f"reading {take} ..."):
        from services.takes.info import info as read_info
        from services.takes.info_text import lines_of

        found = read_info(take)
    if as_json:
        typer.echo(json.dumps(asdict(found), indent=2))
    else:
        for line in lines_of(found):
            typer.echo(line)
    if found.cut:
        typer.echo(f"lost: {found.cut}", err=True)
    raise typer.Exit(LOSS if found.cut else DONE)


def recover(
    take: TakePath,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="The new file; default: TAKE-recovered.mcap.", show_default=False
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a cut or damaged take anew: all that is whole, with index and summary, and say what was lost.

    The take itself is not touched. Exit status: 0 nothing was lost, 3 something was, 1 there is nothing to recover.

    Example: `zenocap recover recordings/demo.mcap -o whole.mcap`
    """
    with one_line_errors():
        from rich.console import Console
        from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

        from common.take.naming import free_name
        from services.takes.recover import in_words
        from services.takes.recover import recover as run_recover

        output = output or free_name(take.with_name(f"{take.stem}-recovered{take.suffix}"))
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TimeRemainingColumn())
        with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
            bar = progress.add_task(take.name, total=take.stat().st_size if take.is_file() else None)
            found = run_recover(take, output, lambda done: progress.update(bar, completed=done))
    if as_json:
        typer.echo(json.dumps(asdict(found), indent=2, default=str))
    else:
        typer.echo(f"{output}: {found.messages} messages, {found.bytes / 1e6:.1f} MB, {found.attachments} files")
        for line in in_words(found):
            typer.echo(line, err=True)
    raise typer.Exit(LOSS if found.lost else DONE)
