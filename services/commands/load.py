"""The command that finds out how much a rig, a machine or a network can take: load."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from services.commands.options import ConfigOption, ConnectOption, JsonOption, one_line_errors

WIDTH = 150  # of tables where there is no terminal
WHAT, HOW, WHERE = "What is offered", "What is measured", "Where"


def load(
    viewers: Annotated[int, typer.Option(min=2, help="Viewers of each rig.", rich_help_panel=WHAT)] = 2,
    rigs: Annotated[int, typer.Option(min=1, help="Rigs, each with its integrator.", rich_help_panel=WHAT)] = 1,
    rate: Annotated[float, typer.Option(min=1.0, help="Frames per second of each viewer.", rich_help_panel=WHAT)] = 30.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Of the pictures.", rich_help_panel=WHAT)] = "160x120",
    method: Annotated[
        Literal["two-view", "hybrid"] | None,
        typer.Option(help="Default: two-view for two viewers, else hybrid.", show_default=False, rich_help_panel=WHAT),
    ] = None,
    silhouettes: Annotated[
        bool,
        typer.Option(
            "--silhouettes",
            help="Stand-ins for the viewers: they say what real ones said of the same film, and compute nothing.",
            rich_help_panel=WHAT,
        ),
    ] = False,
    subscribers: Annotated[
        int, typer.Option(min=0, help="More processes that hear everything of each rig.", rich_help_panel=WHAT)
    ] = 0,
    log: Annotated[
        bool, typer.Option("--log", help="Integrators write takes; they are thrown away.", rich_help_panel=WHAT)
    ] = False,
    until: Annotated[
        Literal["pose", "silhouette"],
        typer.Option(help="What must come of every instant; with silhouette no pose is looked for.", rich_help_panel=HOW),
    ] = "pose",
    seconds: Annotated[float, typer.Option(min=1.0, help="Measured, for each load.", rich_help_panel=HOW)] = 10.0,
    settle: Annotated[float, typer.Option(min=0.0, help="Seconds of running before.", rich_help_panel=HOW)] = 3.0,
    ramp: Annotated[
        Literal["rate", "viewers", "rigs"] | None,
        typer.Option(help="Double it until something gives, then find the limit in between.", rich_help_panel=HOW),
    ] = None,
    soak: Annotated[
        float | None,
        typer.Option(metavar="MINUTES", min=0.1, help="Run for so long: is everything flat?", rich_help_panel=HOW),
    ] = None,
    restart_every: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.0, help="Of a soak: kill a viewer; 0 for never.", rich_help_panel=HOW)
    ] = 60.0,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Where JSON, CSV and PNG go.", rich_help_panel=HOW)
    ] = Path("load"),
    json: JsonOption = False,
    connect: ConnectOption = None,
    config: ConfigOption = None,
    mesh: Annotated[
        bool, typer.Option("--mesh", help="Peers without a router, as `zenocap up` has it.", rich_help_panel=WHERE)
    ] = False,
    part: Annotated[
        Literal["all", "viewers", "integrators"],
        typer.Option(help="Start this part of the load; the other runs elsewhere.", rich_help_panel=WHERE),
    ] = "all",
    name: Annotated[str, typer.Option(help="Of the load's rigs: NAME-1, NAME-2, ...", rich_help_panel=WHERE)] = "load",
) -> None:
    """How many frames, viewers and rigs this machine and its network can take, and what gives first.

    Starts real viewers on films rendered beforehand, integrators and trackers, and measures from the moment a frame is due
    to the moment its pose is here. A load is held when nothing is lost, 99 of 100 poses come within one frame period, and
    nothing piles up. Needs `pip install 'zenocap[load]'`. Ctrl-C ends it, and writes what was measured.

    Examples: `zenocap load --rate 60`, `zenocap load --ramp rate`, `zenocap load --rigs 4 --silhouettes`,
    `zenocap load --soak 60`, `zenocap load --connect tcp/192.168.1.2:7447 --part viewers`
    """
    from rich.console import Console

    from common.runtime.signals import stop_signals
    from services.load.plan import Plan, PlanError, checked

    try:
        plan = checked(
            Plan(
                viewers, rigs, rate, _size(size), method or ("two-view" if viewers == 2 and until == "pose" else "hybrid"),
                until, silhouettes, subscribers, seconds, settle, mesh, log, part, name,
            )
        )  # fmt: skip
        if mesh and connect:
            raise PlanError("--mesh --connect: allowed: one of them")
        if part != "all" and not connect:
            raise PlanError(f"--part {part}: allowed: with --connect, to where the other part is")
        if soak is not None and ramp is not None:
            raise PlanError("--soak --ramp: allowed: one of them")
    except PlanError as error:
        raise typer.BadParameter(str(error)) from None
    try:
        from services.load.shell import Network, prepared, run_load, run_soak, serve
    except ModuleNotFoundError as error:
        typer.echo(f"error: {error.name} is missing: pip install 'zenocap[load]'", err=True)
        raise typer.Exit(1) from None
    out = Console(quiet=json)
    if not out.is_terminal:
        out = Console(quiet=json, width=WIDTH)
    progress = Console(stderr=True)
    with one_line_errors(), stop_signals() as stopped:
        with prepared(plan, Network(tuple(connect or ()), config), stopped, progress) as session:
            if part == "integrators":
                raise typer.Exit(serve(plan, session, out))
            if soak is not None:
                status, written = run_soak(plan, soak, restart_every, session, output, out)
            else:
                status, written = run_load(plan, ramp, session, output, out)
        if json:
            typer.echo(written.decode(), nl=False)
        raise typer.Exit(status)


def _size(text: str) -> tuple[int, int]:
    """Raises PlanError."""
    from services.load.plan import PlanError

    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 16 <= int(width) <= 4096 and 16 <= int(height) <= 4096):
        raise PlanError(f"--size {text!r}: allowed: WIDTHxHEIGHT, each 16 to 4096, such as 160x120")
    return int(width), int(height)
