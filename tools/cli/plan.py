"""The command that adds up the needs of an installation: plan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import JsonOption, one_line_errors, size_of
from zenocap.tools.option_groups import EXPERT, option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.measure.unit_costs import Costs


@dataclass(frozen=True)
class PlanArguments:
    """The installation."""

    cameras: int = option(4, "Number of cameras, of all rigs.", min=2)
    fps: float = option(30.0, "Frames per second.", min=1.0, max=1000.0)
    size: str = option("640x480", "Image size (px).", metavar="WxH")
    method: Literal["two-view", "hybrid"] = option("hybrid", "Tracking method.")
    rigs: int = option(1, "Number of rigs, of equal size.", min=1)
    pages: int = option(1, "Open pages of each rig.", min=0)
    cores: int | None = option(None, "Cores of one machine.", min=1)
    json: JsonOption = False


@dataclass(frozen=True)
class PlanExpert:
    """Its network and log, and the costs of a machine."""

    routers: int = option(0, "Routers that share the rigs, below one more; 0: one machine or a mesh.", min=0)
    log: bool = option(True, "Whether takes are written.", "--log/--no-log")
    foxglove: bool = option(True, "Takes with channels for Foxglove.", "--foxglove/--no-foxglove")
    costs: Path | None = option(None, "Costs of a machine; default: of two cores of a small server.", metavar="FILE")
    measure: Path | None = option(
        None, "Measure the costs on this machine in two minutes, write them, and use them.", metavar="FILE"
    )


def plan(*, given: PlanArguments, expert: Annotated[PlanExpert, EXPERT]) -> None:
    """Calculate the cores, memory and network of an installation.

    From measured costs; also the disk that takes need. Nothing is started, except with --measure, which needs the
    extra load and a quiet machine. Costs are of processor time: a camera's own driver, and images that
    are larger than the working size, come on top.

    Examples: `zenocap plan --cameras 24 --fps 30 --size 640x480`, `zenocap plan --cameras 100 --rigs 25 --routers 2`
    """
    import msgspec

    from zenocap.tools.measure.installation import Installation, checked, demand
    from zenocap.tools.measure.installation_plan import lines_of
    from zenocap.tools.measure.unit_costs import COSTS as DEFAULT
    from zenocap.tools.measure.unit_costs import read_costs

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
    from zenocap.tools.measure.installation_plan import measured, plans
    from zenocap.tools.measure.load_processes import LoadNetwork
    from zenocap.tools.measure.load_session import prepared
    from zenocap.tools.measure.unit_costs import write_costs

    with stop_signals() as stopped, prepared(plans(size)[1], LoadNetwork(), stopped, Console(stderr=True)) as session:
        found = measured(costs, size, session.measure)
    write_costs(path, found)
    return found
