"""Commands that read takes: info, recover."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from msgspec import to_builtins

from zenocap.tools.cli.frame_range import FrameRange
from zenocap.tools.cli.options import DONE, LOSS, JsonOption, TakePath, checked_take, one_line_errors
from zenocap.tools.cli.progress import progress


def info(take: TakePath, as_json: JsonOption = False, *, span: FrameRange) -> None:
    """Show the content of a take, and the verdict on its poses.

    Channels with rates and gaps, missing frames, frame sets, health, versions, files. Also the verdict: whether the
    poses can be used, the reasons, and the parts that are less than good. Reads the whole file, or the part from --from
    to --until; the verdict of a part is on that part, unless one was recorded in it. Of a cut or damaged take,
    everything that is intact; then exit status 3.

    Example: `zenocap info recordings/demo.mcap`
    """
    first, last = span.bounds()
    with one_line_errors(), progress(f"reading {take}", "messages") as state:
        from zenocap.tools.takes.info import info as read_info
        from zenocap.tools.takes.info_text import lines_of

        found = read_info(checked_take(take), first, last, state.update)
    if as_json:
        typer.echo(json.dumps(asdict(found), indent=2, default=to_builtins))
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
            "-o", "--output", metavar="FILE", help="File to write; default: TAKE-recovered.mcap.", show_default=False
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Copy what is intact in a damaged take, and list what is lost.

    The take may be cut or damaged; the new file has an index and a summary. The take itself is not changed. Exit
    status: 0 nothing is lost, 3 something is, 1 there is nothing to recover.

    Example: `zenocap recover recordings/demo.mcap -o whole.mcap`
    """
    with one_line_errors():
        from zenocap.common.recording.parts import free_name
        from zenocap.tools.takes.recover import loss_lines
        from zenocap.tools.takes.recover import recover as run_recover

        checked_take(take)
        output = output or free_name(take.with_name(f"{take.stem}-recovered{take.suffix}"))
        with progress(f"recovering {take.name}", "bytes", take.stat().st_size) as state:
            found = run_recover(take, output, state.update)
    if as_json:
        typer.echo(json.dumps(asdict(found), indent=2, default=str))
    else:
        typer.echo(f"{output}: {found.messages} messages, {found.bytes / 1e6:.1f} MB, {found.attachments} files")
        for line in loss_lines(found):
            typer.echo(line, err=True)
    raise typer.Exit(LOSS if found.lost else DONE)
