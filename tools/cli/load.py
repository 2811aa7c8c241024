"""The command that measures the capacity of a machine and its network: load."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from zenocap.tools.cli.options import JsonOption, one_line_errors
from zenocap.tools.service_arguments import ConfigOption, ConnectOption

WIDTH = 150  # of tables where there is no terminal
WHAT, HOW, WHERE = "Load", "Measurement", "Network"


def load(
    viewers: Annotated[int, typer.Option(min=2, help="Number of viewers per rig.", rich_help_panel=WHAT)] = 2,
    rigs: Annotated[int, typer.Option(min=1, help="Number of rigs, each with its integrator.", rich_help_panel=WHAT)] = 1,
    rate: Annotated[
        float, typer.Option(min=1.0, help="Frames per second (FPS) of each viewer.", rich_help_panel=WHAT)
    ] = 30.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Image size (px).", rich_help_panel=WHAT)] = "160x120",
    method: Annotated[
        Literal["two-view", "hybrid"] | None,
        typer.Option(
            help="Tracking method; default: two-view for two viewers, else hybrid.",
            show_default=False,
            rich_help_panel=WHAT,
        ),
    ] = None,
    silhouettes: Annotated[
        bool,
        typer.Option(
            "--silhouettes",
            help="Replace the viewers by stand-ins, which publish recorded messages and compute nothing.",
            rich_help_panel=WHAT,
        ),
    ] = False,
    subscribers: Annotated[
        int,
        typer.Option(
            min=0, help="Number of additional processes per rig that subscribe to every topic.", rich_help_panel=WHAT
        ),
    ] = 0,
    subscriber_priority: Annotated[
        Literal["low", "normal"],
        typer.Option(
            help="Priority of the additional subscribers: low, as the animator's, or normal, as that of other programs.",
            rich_help_panel=WHAT,
        ),
    ] = "low",
    log: Annotated[
        bool, typer.Option("--log", help="Let integrators write takes, which are deleted.", rich_help_panel=WHAT)
    ] = False,
    until: Annotated[
        Literal["pose", "silhouette"],
        typer.Option(help="Result that completes a frame set; with silhouette no pose is computed.", rich_help_panel=HOW),
    ] = "pose",
    seconds: Annotated[float, typer.Option(min=1.0, help="Measured time for each load (s).", rich_help_panel=HOW)] = 10.0,
    settle: Annotated[float, typer.Option(min=0.0, help="Warm-up time before measuring (s).", rich_help_panel=HOW)] = 3.0,
    ramp: Annotated[
        Literal["rate", "viewers", "rigs"] | None,
        typer.Option(
            help="Quantity to double until the load is no longer held; then the limit is found by bisection.",
            rich_help_panel=HOW,
        ),
    ] = None,
    soak: Annotated[
        float | None,
        typer.Option(
            metavar="MINUTES",
            min=0.1,
            help="Run a soak test: do memory, handles and latency stay flat?",
            rich_help_panel=HOW,
        ),
    ] = None,
    restart_every: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            help="Interval at which a soak test kills a viewer (s); 0 for never.",
            rich_help_panel=HOW,
        ),
    ] = 60.0,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for JSON, CSV and PNG.", rich_help_panel=HOW)
    ] = Path("load"),
    json: JsonOption = False,
    connect: ConnectOption = None,
    config: ConfigOption = None,
    mesh: Annotated[
        bool, typer.Option("--mesh", help="Connect peers without a router, as `zenocap up` does.", rich_help_panel=WHERE)
    ] = False,
    part: Annotated[
        Literal["all", "viewers", "integrators"],
        typer.Option(help="Part of the load to start here; the other runs on another machine.", rich_help_panel=WHERE),
    ] = "all",
    name: Annotated[
        str, typer.Option(help="Prefix of the rigs' names: NAME-1, NAME-2, ...", rich_help_panel=WHERE)
    ] = "load",
) -> None:
    """Measure how many frames, viewers and rigs this machine and its network can process, and the bottleneck.

    Starts viewers on rendered films, integrators and trackers, and measures the latency from the time a frame is due to the
    arrival of its pose. A load is held when nothing is lost, 99 % of the poses arrive within one frame period, and no
    backlog grows. Needs `pip install 'zenocap[load]'`. Ctrl-C ends it and writes the results so far.

    Examples: `zenocap load --rate 60`, `zenocap load --rate 1000` (frame sets per second reached, and cores used),
    `zenocap load --ramp rate`, `zenocap load --rigs 4 --silhouettes`,
    `zenocap load --soak 60`, `zenocap load --connect tcp/192.168.1.2:7447 --part viewers`
    """
    from rich.console import Console

    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.load_test.plan import Plan, PlanError, checked

    try:
        plan = checked(
            Plan(
                viewers, rigs, rate, _size(size), method or ("two-view" if viewers == 2 and until == "pose" else "hybrid"),
                until, silhouettes, subscribers, seconds, settle, mesh, log, part, name,
                subscriber_priority,
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
        from zenocap.tools.load_test.shell import Network, prepared, run_load, run_soak, serve
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
    from zenocap.tools.load_test.plan import PlanError

    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 16 <= int(width) <= 4096 and 16 <= int(height) <= 4096):
        raise PlanError(f"--size {text!r}: allowed: WIDTHxHEIGHT, each 16 to 4096, such as 160x120")
    return int(width), int(height)
