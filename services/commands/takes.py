"""Commands that work on takes: info, export, recover."""

import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

import typer

from services.commands.options import DONE, LOSS, JsonOption, OutputOption, TakePath, one_line_errors


def export(
    take: TakePath,
    to: Annotated[Literal["trc", "csv"], typer.Option(help="trc: joint centres. csv: angles, scores and joint centres.")],
    output: OutputOption,
) -> None:
    """Write the poses of a take for other programs.

    trc: OpenSim and Pose2Sim, metres, Y up, HALPE names. csv: one row per frame, degrees and metres.

    Example: `zenocap export walk.mcap --to trc -o walk.trc`
    """
    with one_line_errors():
        from services.takes.export import export as run_export

        poses = run_export(take, to, output)
    typer.echo(f"{output}: {len(poses.baps)} frames, {poses.frames[0]} to {poses.frames[-1]}")
    if poses.cut:
        typer.echo(f"lost: {poses.cut}", err=True)
    raise typer.Exit(LOSS if poses.cut else DONE)


def info(take: TakePath, as_json: JsonOption = False) -> None:
    """What is in a take: messages by key, rates, versions, and whether it is whole.

    Example: `zenocap info recordings/demo.mcap`
    """
    with one_line_errors():
        from services.takes.info import info as read_info

        found = read_info(take)
    if as_json:
        typer.echo(json.dumps(asdict(found), indent=2))
    else:
        start = datetime.fromtimestamp(found.start_ns / 1e9, UTC)
        typer.echo(f"{found.path}: {found.messages} messages, {found.size_bytes / 1e6:.1f} MB")
        typer.echo(f"start     {start:%Y-%m-%d %H:%M:%S} UTC, {found.duration_s:.1f} s")
        for name, values in found.metadata.items():
            typer.echo(f"{name:9} {', '.join(f'{key} {value}' for key, value in values.items())}")
        for name, size in found.attachments.items():
            typer.echo(f"file      {name}, {size} bytes")
        width = max((len(channel.key) for channel in found.channels), default=0)
        for channel in found.channels:
            typer.echo(f"{channel.key:{width}} {channel.messages:7d}  {channel.rate:6.1f}/s  {channel.schema}")
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
