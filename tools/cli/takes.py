"""Commands that judge takes, and repair them: info, verify, mirror, recover."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer
from msgspec import to_builtins

from zenocap.tools.cli.options import (
    DONE,
    FAILED,
    LOSS,
    FrameRange,
    JsonOption,
    TakePath,
    checked_take,
    echo,
    one_line_errors,
)
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import option


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


def verify(
    takes: Annotated[list[Path], typer.Argument(metavar="TAKE...", help="A take (MCAP file), or the parts of one.")],
    tolerance: Annotated[
        float,
        typer.Option(
            min=0,
            max=1,
            help="Allowed difference of numbers, relative or absolute; 1e-6 for a take of another kind of processor.",
        ),
    ] = 0.0,
    as_json: JsonOption = False,
) -> None:
    """Recompute a take, and compare it byte for byte.

    Every derived message is compared. Each service receives its recorded inputs again, in the order of its input trace;
    the messages that its step publishes must equal the recorded ones. Needs no network and no video. It starts at the
    beginning, because every pose depends on those before.

    Exit status 0: all equal. 1: a message differs or is missing from the take; the first difference is printed field by
    field. 3: equal, but not everything could be checked, or messages were lost on the way to the log.

    Example: `zenocap verify monday.mcap`
    """
    with one_line_errors():
        from zenocap.tools.takes.verify.recompute import verify as run_verify
        from zenocap.tools.takes.verify.result import data_of, report

        for take in takes:
            checked_take(take)
        started_s = monotonic()
        with progress("verifying", "messages") as state:
            found = run_verify(takes, tolerance, state.update)
        elapsed_s = monotonic() - started_s
    if as_json:
        typer.echo(json.dumps(data_of(found, elapsed_s), indent=2))
    else:
        for line in report(found, elapsed_s):
            echo(line)
    raise typer.Exit(FAILED if found.failed else DONE if found.complete else LOSS)


@dataclass(frozen=True)
class MirrorArguments:
    """since, until: times since frame 0, in words."""

    since: Annotated[
        str, typer.Option("--from", metavar="SECONDS", help="Time since frame 0 from which on they are exchanged.")
    ]
    until: str | None = option(None, "Time from which on they are as before; default: the end.", "--to", metavar="SECONDS")
    output: Path | None = option(
        None, "Take to write; default: TAKE-mirrored.mcap beside it.", "-o", "--output", metavar="FILE"
    )
    jobs: int | None = option(None, "Number of cores to use; the output does not depend on it; default: all.", min=1)


def mirror(take: TakePath, *, given: MirrorArguments) -> None:
    """Exchange front and back from a time on, and track again.

    For a take in which the tracker took the back of the person for the front; left and right are exchanged too. The
    tracker runs again on the silhouettes of the take; the videos are not needed. At the given time the body is turned
    round in its place, with left and right limbs exchanged; all later poses are computed anew, also those of the second
    pass if the take has one. The take itself is not changed.

    Exit status 3: done, but the silhouettes turned the track back within a second.

    Example: `zenocap mirror walk.mcap --from 12.4`
    """
    from_s, until_s = seconds("--from", given.since), None if given.until is None else seconds("--to", given.until)
    output = take.with_name(f"{take.stem}-mirrored{take.suffix}") if given.output is None else given.output
    with one_line_errors():
        from zenocap.common.session.lookahead import available_cores
        from zenocap.tools.takes.mirror import TRACKING
        from zenocap.tools.takes.mirror import mirror as run_mirror

        checked_take(take)
        with progress(TRACKING, "poses") as state:

            def on_progress(activity: str, done: int, total: int) -> None:
                if state.activity != activity:
                    state.restart(activity, total)
                state.update(done, total)

            found = run_mirror(take, output, from_s, until_s, on_progress, given.jobs or available_cores())
    end = "the end" if found.until_s is None else f"{found.until_s:.3f} s"
    both = " tracked both ways" if found.both_ways else ""
    typer.echo(f"{output}: {found.poses} poses{both}, exchanged from {found.from_s:.3f} s to {end}")
    if found.turned_back_s is not None:
        typer.echo(
            f"turned back: at {found.turned_back_s:.3f} s the person faces as in {take} again: the silhouettes show it so",
            err=True,
        )
    raise typer.Exit(DONE if found.turned_back_s is None else LOSS)


def seconds(option: str, text: str) -> float:
    """Seconds of "12.4" and "12.4s".  Raises typer.BadParameter."""
    found = re.fullmatch(r"(\d{1,9}(?:\.\d{0,9})?)s?", text)
    if not found:
        raise typer.BadParameter(f"{option} {text!r}: allowed: seconds since frame 0, such as 12.4")
    return float(found[1])


def recover(
    take: TakePath,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="File to write; default: TAKE-recovered.mcap.")
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
