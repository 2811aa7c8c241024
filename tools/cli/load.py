"""The command that measures the capacity of a machine and its network: load."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import pip_install
from zenocap.tools.cli.options import FAILED, JsonOption, one_line_errors, refuse, size_of
from zenocap.tools.option_groups import EXPERT, RESEARCH, option
from zenocap.tools.service_arguments import ConnectArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from rich.console import Console

    from zenocap.tools.measure.load_plan import Plan

WIDTH = 150  # of tables where there is no terminal


@dataclass(frozen=True)
class LoadArguments:
    """The load, and how it is measured."""

    viewers: int = option(2, "Number of viewers per rig.", min=2)
    rigs: int = option(1, "Number of rigs, each with its integrator.", min=1)
    rate: float = option(30.0, "Frames per second (FPS) of each viewer.", min=1.0)
    size: str = option("160x120", "Image size (px).", metavar="WxH")
    method: Literal["two-view", "hybrid"] | None = option(
        None, "Tracking method; default: two-view for two viewers, else hybrid."
    )
    seconds: float = option(10.0, "Measured time for each load (s).", min=1.0)
    ramp: Literal["rate", "viewers", "rigs"] | None = option(
        None, "Quantity to double until the load is no longer held; then the limit is found by bisection."
    )
    soak: float | None = option(
        None, "Run a soak test: do memory, handles, disk and latency stay flat?", metavar="MINUTES", min=0.1
    )
    output: Path = option(Path("load"), "Folder for JSON, CSV and PNG.", "-o", "--output", metavar="DIR")
    json: JsonOption = False


@dataclass(frozen=True)
class LoadExpert:
    """Parts of the measurement, and the network."""

    log: bool = option(False, "Let integrators write takes, which are deleted.")
    settle: float = option(3.0, "Warm-up time before measuring (s).", min=0.0)
    restart_every: float = option(
        60.0, "Interval at which a soak test kills a viewer (s); 0 for never.", metavar="SECONDS", min=0.0
    )
    mesh: bool = option(False, "Connect peers without a router, as `zenocap up` does.")
    part: Literal["all", "viewers", "integrators"] = option(
        "all", "Part of the load to start here; the other runs on another machine."
    )
    name: str = option("load", "Prefix of the rigs' names: NAME-1, NAME-2, ...")


@dataclass(frozen=True)
class LoadResearch:
    """Loads that no rig has."""

    silhouettes: bool = option(
        False, "Replace the viewers by stand-ins, which publish recorded messages and compute nothing."
    )
    subscribers: int = option(0, "Number of additional processes per rig that subscribe to every topic.", min=0)
    subscriber_priority: Literal["low", "normal"] = option(
        "low", "Priority of the additional subscribers: low, as the animator's, or normal, as that of other programs."
    )
    until: Literal["pose", "silhouette"] = option(
        "pose", "Result that completes a frame set; with silhouette no pose is computed."
    )


def load(
    *, given: LoadArguments, expert: Annotated[LoadExpert, EXPERT], research: Annotated[LoadResearch, RESEARCH],
    running: ConnectArguments,
) -> None:  # fmt: skip
    """Measure how many frames, viewers and rigs this machine can take.

    Measures its network too, and names the bottleneck. Starts viewers on rendered films, integrators and trackers, and
    measures the latency from the time a frame is due to the arrival of its pose. A load is held when nothing is lost,
    99 % of the poses arrive within one frame period, and no backlog grows. Needs the extra load. Ctrl-C
    ends it and writes the results so far.

    Examples: `zenocap load --rate 60`, `zenocap load --rate 1000` (frame sets per second reached, and cores used),
    `zenocap load --ramp rate`, `zenocap load --rigs 4 --silhouettes`,
    `zenocap load --soak 60`, `zenocap load --connect tcp/192.168.1.2:7447 --part viewers`
    """
    from rich.console import Console

    from zenocap.common.runtime.signals import stop_signals

    plan = _plan(given, expert, research, running)
    try:
        from zenocap.tools.measure.load_processes import LoadNetwork
        from zenocap.tools.measure.load_session import prepared, run_load, run_soak, serve
    except ModuleNotFoundError as error:
        typer.echo(f"error: {error.name} is missing: {pip_install('load')}", err=True)
        raise typer.Exit(FAILED) from None
    out = _output(given.json)
    with one_line_errors(), stop_signals() as stopped:
        network = LoadNetwork(tuple(running.connect or ()), running.config)
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


def _output(quiet: bool) -> Console:
    """Standard output, WIDTH columns wide where it is no terminal."""
    from rich.console import Console

    found = Console(quiet=quiet)
    return found if found.is_terminal else Console(quiet=quiet, width=WIDTH)


def _plan(given: LoadArguments, expert: LoadExpert, research: LoadResearch, running: ConnectArguments) -> Plan:
    """Raises typer.BadParameter."""
    from zenocap.tools.measure.load_plan import Plan, PlanError, checked

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
    refuse(wrong)
    return plan
