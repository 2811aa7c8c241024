"""The command that recomputes takes: verify."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer

from zenocap.tools.cli.options import DONE, FAILED, LOSS, JsonOption, checked_take, echo, one_line_errors
from zenocap.tools.cli.progress import progress


def verify(
    takes: Annotated[
        list[Path], typer.Argument(metavar="TAKE...", help="A take (MCAP file), or the parts of one.", show_default=False)
    ],
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
    field. 3: equal, but not everything could be checked.

    Example: `zenocap verify monday.mcap`
    """
    with one_line_errors():
        from zenocap.tools.takes.verify.recompute import verify as run_verify
        from zenocap.tools.takes.verify.result import other_versions, report

        for take in takes:
            checked_take(take)
        started_s = monotonic()
        with progress("verifying", "messages") as state:
            found = run_verify(takes, tolerance, state.update)
        elapsed_s = monotonic() - started_s
    if as_json:
        values = asdict(found) | {"reasons": [str(reason) for reason in found.reasons]}
        values |= {"elapsed_s": elapsed_s, "differing_versions": other_versions(found)}
        typer.echo(json.dumps(values, indent=2))
    else:
        for line in report(found, elapsed_s):
            echo(line)
    raise typer.Exit(FAILED if found.failed else DONE if found.complete else LOSS)
