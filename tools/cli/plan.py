"""The command that says what an installation needs: plan."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import JsonOption, one_line_errors

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.tools.measure.unit_costs import Costs

WHAT, COSTS = "Installation", "Costs"


def plan(
    cameras: Annotated[int, typer.Option(min=2, help="Number of cameras, of all rigs.", rich_help_panel=WHAT)] = 4,
    fps: Annotated[float, typer.Option(min=1.0, max=1000.0, help="Frames per second.", rich_help_panel=WHAT)] = 30.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Image size (px).", rich_help_panel=WHAT)] = "640x480",
    method: Annotated[
        Literal["two-view", "hybrid"], typer.Option(help="Tracking method.", rich_help_panel=WHAT)
    ] = "hybrid",
    rigs: Annotated[int, typer.Option(min=1, help="Number of rigs, of equal size.", rich_help_panel=WHAT)] = 1,
    pages: Annotated[int, typer.Option(min=0, help="Open pages of each rig.", rich_help_panel=WHAT)] = 1,
    routers: Annotated[
        int,
        typer.Option(
            min=0, help="Routers that share the rigs, below one more; 0: one machine or a mesh.", rich_help_panel=WHAT
        ),
    ] = 0,
    cores: Annotated[
        int | None, typer.Option(min=1, help="Cores of one machine.", show_default=False, rich_help_panel=WHAT)
    ] = None,
    log: Annotated[bool, typer.Option("--log/--no-log", help="Whether takes are written.", rich_help_panel=WHAT)] = True,
    foxglove: Annotated[
        bool, typer.Option("--foxglove/--no-foxglove", help="Takes with channels for Foxglove.", rich_help_panel=WHAT)
    ] = True,
    costs: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Costs of a machine; default: of two cores of a small server.",
            show_default=False,
            rich_help_panel=COSTS,
        ),
    ] = None,
    measure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Measure the costs on this machine in two minutes, write them, and use them.",
            show_default=False,
            rich_help_panel=COSTS,
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Cores, memory, network and disk that an installation needs, from measured costs.

    Nothing is started, except with --measure, which needs `pip install 'zenocap[load]'` and a quiet machine. Costs are of
    processor time: a camera's own driver, and images that are larger than the working size, come on top.

    Examples: `zenocap plan --cameras 24 --fps 30 --size 640x480`, `zenocap plan --cameras 100 --rigs 25 --routers 2`
    """
    import msgspec

    from zenocap.tools.measure.installation import Installation, checked, demand
    from zenocap.tools.measure.installation_plan import lines_of
    from zenocap.tools.measure.unit_costs import COSTS as DEFAULT
    from zenocap.tools.measure.unit_costs import read_costs

    with one_line_errors():
        given = Installation(
            cameras, fps, _size(size), method, rigs, pages, log=log, foxglove=foxglove, routers=routers, cores=cores
        )
        checked(given)
        known = DEFAULT if costs is None else read_costs(costs)
        if measure is not None:
            known = _measured(known, given.size, measure)
        if json:
            typer.echo(msgspec.json.format(msgspec.json.encode({"installation": given, "demand": demand(given, known)})))
            return
        for line in lines_of(given, known):
            typer.echo(line)


def _measured(costs: "Costs", size: tuple[int, int], path: Path) -> "Costs":
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


def _size(text: str) -> tuple[int, int]:
    """Width and height.  Raises UserError."""
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 16 <= int(width) <= 8192 and 16 <= int(height) <= 8192):
        raise UserError(f"--size {text!r}: allowed: WIDTHxHEIGHT, each 16 to 8192, such as 640x480")
    return int(width), int(height)
