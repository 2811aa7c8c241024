"""The command that says what an installation needs: plan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.expansion import EXPERT
from zenocap.tools.cli.options import JsonOption, one_line_errors, size_of

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.plan.costs import Costs


@dataclass(frozen=True)
class PlanArguments:
    """The installation."""

    cameras: Annotated[int, typer.Option(min=2, help="Number of cameras, of all rigs.")] = 4
    fps: Annotated[float, typer.Option(min=1.0, max=1000.0, help="Frames per second.")] = 30.0
    size: Annotated[str, typer.Option(metavar="WxH", help="Image size (px).")] = "640x480"
    method: Annotated[Literal["two-view", "hybrid"], typer.Option(help="Tracking method.")] = "hybrid"
    rigs: Annotated[int, typer.Option(min=1, help="Number of rigs, of equal size.")] = 1
    pages: Annotated[int, typer.Option(min=0, help="Open pages of each rig.")] = 1
    cores: Annotated[int | None, typer.Option(min=1, help="Cores of one machine.", show_default=False)] = None
    json: JsonOption = False


@dataclass(frozen=True)
class PlanExpert:
    """Its network and log, and the costs of a machine."""

    routers: Annotated[
        int,
        typer.Option(min=0, help="Routers that share the rigs, below one more; 0: one machine or a mesh."),
    ] = 0
    log: Annotated[bool, typer.Option("--log/--no-log", help="Whether takes are written.")] = True
    foxglove: Annotated[bool, typer.Option("--foxglove/--no-foxglove", help="Takes with channels for Foxglove.")] = True
    costs: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Costs of a machine; default: of two cores of a small server.",
            show_default=False,
        ),
    ] = None
    measure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Measure the costs on this machine in two minutes, write them, and use them.",
            show_default=False,
        ),
    ] = None


def plan(*, given: PlanArguments, expert: Annotated[PlanExpert, EXPERT]) -> None:
    """Cores, memory, network and disk that an installation needs, from measured costs.

    Nothing is started, except with --measure, which needs `pip install 'zenocap[load]'` and a quiet machine. Costs are of
    processor time: a camera's own driver, and images that are larger than the working size, come on top.

    Examples: `zenocap plan --cameras 24 --fps 30 --size 640x480`, `zenocap plan --cameras 100 --rigs 25 --routers 2`
    """
    import msgspec

    from zenocap.tools.plan.calculator import Installation, checked, demand
    from zenocap.tools.plan.costs import read_costs
    from zenocap.tools.plan.parameters import COSTS as DEFAULT
    from zenocap.tools.plan.text import lines_of

    with one_line_errors():
        size = size_of(given.size, 16, 8192)
        if size is None:
            raise UserError(f"--size {given.size!r}: allowed: WIDTHxHEIGHT, each 16 to 8192, such as 640x480")
        planned = Installation(
            given.cameras, given.fps, size, given.method, given.rigs, given.pages, log=expert.log,
            foxglove=expert.foxglove, routers=expert.routers, cores=given.cores,
        )  # fmt: skip
        checked(planned)
        known = DEFAULT if expert.costs is None else read_costs(expert.costs)
        if expert.measure is not None:
            known = _measured(known, size, expert.measure)
        if given.json:
            content = msgspec.json.encode({"installation": planned, "demand": demand(planned, known)})
            typer.echo(msgspec.json.format(content))
            return
        for line in lines_of(planned, known):
            typer.echo(line)


def _measured(costs: Costs, size: tuple[int, int], path: Path) -> Costs:
    """Measure the costs, and write them to `path`.  Raises UserError, BusError and OSError."""
    from rich.console import Console

    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.load_test.shell import Network, prepared
    from zenocap.tools.plan.costs import write_costs
    from zenocap.tools.plan.measure import measured, plans

    with stop_signals() as stopped, prepared(plans(size)[1], Network(), stopped, Console(stderr=True)) as session:
        found = measured(costs, size, session.measure)
    write_costs(path, found)
    return found
