"""`zenocap posture act`: generate a posture dataset of simulated people."""

from __future__ import annotations

import signal
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Annotated, Literal, NoReturn

import typer

from zenocap.tools.cli.options import DONE, FAILED, LOSS, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import option


@dataclass(frozen=True)
class ActArguments:
    """people_seed: of the first person.  postures: text with commas."""

    people: int = option(12, "Number of people.", min=1, max=1000)
    people_seed: int = option(0, "First person: seed 12 N.", min=0, max=1_000_000, metavar="N")
    repetitions: int = option(2, "Repetitions of every posture by every person.", min=1, max=10)
    postures: str | None = option(None, "Postures; default: all fifteen.", metavar="NAME,...")
    method: Literal["two-view", "two-view-paper", "hybrid", "truth"] = option(
        "two-view",
        "Tracking: two viewers, the same as printed in the paper, hybrid tracker with four cameras, or none (true angles).",
    )
    jobs: int = option(2, "Number of processes.", min=1, max=64)


def act(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of the takes.")],
    *,
    given: ActArguments,
) -> None:
    """Render simulated people in the fifteen postures and track the videos: the data of the paper's Table 2.

    Writes one take per person, posture and repetition with the tracked poses, and manifest.csv with the start and end of
    each posture. Existing takes are kept, so an interrupted run can be continued. Exit status 3: done, but some takes have
    no poses.

    Example: `zenocap posture act -o acted`, then `zenocap posture evaluate acted/manifest.csv`
    """
    wanted = None if given.postures is None else [name.strip() for name in given.postures.split(",")]
    with one_line_errors():
        from zenocap.common.runtime import logs
        from zenocap.simulation.motion.posture_style import POSTURES
        from zenocap.tools.teach.dataset.batch import MANIFEST, generate_takes, posture_takes
        from zenocap.tools.teach.dataset.batch import people as people_seeds

        logs.configure("act")
        unknown = [name for name in wanted or () if name not in POSTURES]
        if unknown:
            raise typer.BadParameter(f"--postures {', '.join(unknown)}: allowed: {', '.join(POSTURES)}")
        takes = posture_takes(people_seeds(given.people_seed, given.people), wanted or POSTURES, given.repetitions)
        signal.signal(signal.SIGTERM, _stop)
        with progress("rendering", "takes") as state:
            generated = generate_takes(output, given.method, takes, given.jobs, state.update)
    typer.echo(f"{output / MANIFEST}: {len(takes)} takes, {len(generated)} new")
    incomplete = [one for one in generated if one.problems or not one.poses]
    for one in incomplete:
        typer.echo(f"lost: {one.take.name}: {'; '.join(one.problems) or 'no pose'}", err=True)
    raise typer.Exit(LOSS if incomplete else DONE)


def _stop(number: int, frame: FrameType | None) -> NoReturn:
    """End by an exception, so that the pool of processes is ended too."""
    typer.echo("stopped; run the same command again to continue", err=True)
    raise SystemExit(FAILED)
