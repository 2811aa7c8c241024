"""The command that exchanges left and right in a take and tracks it again: mirror."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.options import DONE, LOSS, TakePath, checked_take, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import option


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
