"""`zenocap posture act`: takes of the synthetic actor with their manifest, to learn and to test with."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from services.commands.options import DONE, LOSS, one_line_errors

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from services.takes.act.shell import Report


def act(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the takes.", show_default=False)
    ],
    people: Annotated[int, typer.Option(min=1, max=1000, help="How many.")] = 12,
    people_seed: Annotated[
        int, typer.Option(min=0, max=1_000_000, metavar="N", help="Who: person 12 N and those after.")
    ] = 0,
    repetitions: Annotated[int, typer.Option(min=1, max=10, help="Of every posture, by everybody.")] = 2,
    postures: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="Only these of the fifteen postures of the actor.")
    ] = None,
    method: Annotated[
        Literal["two-view", "hybrid", "truth"],
        typer.Option(help="Who finds the poses: two viewers, the tracker with four, or nobody (the true angles)."),
    ] = "two-view",
    jobs: Annotated[int, typer.Option(min=1, max=64, help="Processes.")] = 2,
) -> None:
    """Film the synthetic actor in the fifteen postures and track the videos: the data of the paper's Table 2.

    Writes one take per person, posture and repetition, with the poses that the services found in the rendered video,
    and manifest.csv with the posture's start and end. Takes that are there already are left as they are, so that it may
    be stopped and started again. Exit status 3: done, but some take has no poses.

    Example: `zenocap posture act -o acted`, then `zenocap posture evaluate acted/manifest.csv`
    """
    wanted = None if postures is None else [name.strip() for name in postures.split(",")]
    with one_line_errors():
        from common.actor.style import POSTURES
        from common.runtime import logs
        from services.takes.act import cast
        from services.takes.act.shell import MANIFEST, perform

        logs.configure("act")
        unknown = [name for name in wanted or () if name not in POSTURES]
        if unknown:
            raise typer.BadParameter(f"--postures {', '.join(unknown)}: allowed: {', '.join(POSTURES)}")
        acts = cast.acts(cast.people(people_seed, people), wanted or POSTURES, repetitions)
        with _progress() as report:
            filmed = perform(output, method, acts, jobs, report)
    typer.echo(f"{output / MANIFEST}: {len(acts)} takes, {len(filmed)} of them new")
    without = [one for one in filmed if one.problems or not one.poses]
    for one in without:
        typer.echo(f"lost: {one.act.name}: {'; '.join(one.problems) or 'no pose'}", err=True)
    raise typer.Exit(LOSS if without else DONE)


@contextmanager
def _progress() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task("getting ready", total=None)
        yield lambda done, of, words: progress.update(bar, completed=done, total=of, description=words or "filming")
