"""The command that measures the capacity of a machine and its network: load."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.expansion import EXPERT, RESEARCH
from zenocap.tools.cli.options import FAILED, JsonOption, one_line_errors, size_of
from zenocap.tools.service_arguments import ConfigOption, ConnectOption

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.load_test.plan import Plan

WIDTH = 150  # of tables where there is no terminal


@dataclass(frozen=True)
class LoadArguments:
    """The load, and how it is measured."""

    viewers: Annotated[int, typer.Option(min=2, help="Number of viewers per rig.")] = 2
    rigs: Annotated[int, typer.Option(min=1, help="Number of rigs, each with its integrator.")] = 1
    rate: Annotated[float, typer.Option(min=1.0, help="Frames per second (FPS) of each viewer.")] = 30.0
    size: Annotated[str, typer.Option(metavar="WxH", help="Image size (px).")] = "160x120"
    method: Annotated[
        Literal["two-view", "hybrid"] | None,
        typer.Option(
            help="Tracking method; default: two-view for two viewers, else hybrid.",
            show_default=False,
        ),
    ] = None
    seconds: Annotated[float, typer.Option(min=1.0, help="Measured time for each load (s).")] = 10.0
    ramp: Annotated[
        Literal["rate", "viewers", "rigs"] | None,
        typer.Option(
            help="Quantity to double until the load is no longer held; then the limit is found by bisection.",
        ),
    ] = None
    soak: Annotated[
        float | None,
        typer.Option(
            metavar="MINUTES",
            min=0.1,
            help="Run a soak test: do memory, handles and latency stay flat?",
        ),
    ] = None
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for JSON, CSV and PNG.")] = Path(
        "load"
    )
    json: JsonOption = False


@dataclass(frozen=True)
class LoadExpert:
    """Parts of the measurement, and the network."""

    log: Annotated[bool, typer.Option("--log", help="Let integrators write takes, which are deleted.")] = False
    settle: Annotated[float, typer.Option(min=0.0, help="Warm-up time before measuring (s).")] = 3.0
    restart_every: Annotated[
        float,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            help="Interval at which a soak test kills a viewer (s); 0 for never.",
        ),
    ] = 60.0
    mesh: Annotated[bool, typer.Option("--mesh", help="Connect peers without a router, as `zenocap up` does.")] = False
    part: Annotated[
        Literal["all", "viewers", "integrators"],
        typer.Option(help="Part of the load to start here; the other runs on another machine."),
    ] = "all"
    name: Annotated[str, typer.Option(help="Prefix of the rigs' names: NAME-1, NAME-2, ...")] = "load"


@dataclass(frozen=True)
class LoadResearch:
    """Loads that no rig has."""

    silhouettes: Annotated[
        bool,
        typer.Option(
            "--silhouettes",
            help="Replace the viewers by stand-ins, which publish recorded messages and compute nothing.",
        ),
    ] = False
    subscribers: Annotated[
        int,
        typer.Option(min=0, help="Number of additional processes per rig that subscribe to every topic."),
    ] = 0
    subscriber_priority: Annotated[
        Literal["low", "normal"],
        typer.Option(
            help="Priority of the additional subscribers: low, as the animator's, or normal, as that of other programs.",
        ),
    ] = "low"
    until: Annotated[
        Literal["pose", "silhouette"],
        typer.Option(help="Result that completes a frame set; with silhouette no pose is computed."),
    ] = "pose"


@dataclass(frozen=True)
class LoadNetwork:
    """A running network to use, in place of one of its own."""

    connect: ConnectOption = None
    config: ConfigOption = None


def load(
    *,
    given: LoadArguments,
    expert: Annotated[LoadExpert, EXPERT],
    research: Annotated[LoadResearch, RESEARCH],
    running: LoadNetwork,
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

    plan = _plan(given, expert, research, running)
    try:
        from zenocap.tools.load_test.shell import Network, prepared, run_load, run_soak, serve
    except ModuleNotFoundError as error:
        typer.echo(f"error: {error.name} is missing: pip install 'zenocap[load]'", err=True)
        raise typer.Exit(FAILED) from None
    out = Console(quiet=given.json)
    if not out.is_terminal:
        out = Console(quiet=given.json, width=WIDTH)
    with one_line_errors(), stop_signals() as stopped:
        network = Network(tuple(running.connect or ()), running.config)
        with prepared(plan, network, stopped, Console(stderr=True)) as session:
            if expert.part == "integrators":
                raise typer.Exit(serve(plan, session, out))
            if given.soak is not None:
                status, written = run_soak(plan, given.soak, expert.restart_every, session, given.output, out)
            else:
                status, written = run_load(plan, given.ramp, session, given.output, out)
        if given.json:
            typer.echo(written.decode(), nl=False)
        raise typer.Exit(status)


def _plan(given: LoadArguments, expert: LoadExpert, research: LoadResearch, running: LoadNetwork) -> Plan:
    """Raises typer.BadParameter."""
    from zenocap.tools.load_test.plan import Plan, PlanError, checked

    size, until = size_of(given.size, 16, 4096), research.until
    method = given.method or ("two-view" if given.viewers == 2 and until == "pose" else "hybrid")
    wrong = {
        "--mesh --connect: allowed: one of them": expert.mesh and running.connect,
        f"--part {expert.part}: allowed: with --connect, to where the other part is": expert.part != "all"
        and not running.connect,
        "--soak --ramp: allowed: one of them": given.soak is not None and given.ramp is not None,
    }
    if size is None:
        raise typer.BadParameter(f"--size {given.size!r}: allowed: WIDTHxHEIGHT, each 16 to 4096, such as 160x120")
    try:
        plan = checked(
            Plan(
                given.viewers, given.rigs, given.rate, size, method, until, research.silhouettes,
                research.subscribers, given.seconds, expert.settle, expert.mesh, expert.log, expert.part, expert.name,
                research.subscriber_priority,
            )
        )  # fmt: skip
    except PlanError as error:
        raise typer.BadParameter(str(error)) from None
    for text, is_wrong in wrong.items():
        if is_wrong:
            raise typer.BadParameter(text)
    return plan
