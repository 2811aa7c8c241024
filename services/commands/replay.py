"""The command that brings takes back to the network: replay."""

from pathlib import Path
from typing import Annotated

import typer

from services.commands.options import (
    PANEL,
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    one_line_errors,
    zenoh_options,
)

TakePaths = Annotated[
    list[Path], typer.Argument(metavar="TAKE...", help="Takes: MCAP files, played one after another.", show_default=False)
]
WHAT, HOW, CHECKING = "What is replayed", "How it is replayed", "Checking a take"
EXPRESSION = "a key expression such as 'viewer/**' or 'zenocap/*/integrator/bap'"


def replay(
    takes: TakePaths,
    rate: Annotated[
        float,
        typer.Option(
            "-r",
            "--rate",
            min=0,
            max=1000,
            help="Times as fast as recorded; 0: as fast as the live services of the rig keep up.",
            rich_help_panel=HOW,
        ),
    ] = 1.0,
    loop: Annotated[
        bool, typer.Option("--loop", help="Again and again, with times and frames that go on.", rich_help_panel=HOW)
    ] = False,
    start_offset: Annotated[
        float, typer.Option("--start-offset", min=0, metavar="SECONDS", help="Skip the beginning.", rich_help_panel=WHAT)
    ] = 0.0,
    duration: Annotated[
        float | None,
        typer.Option("--duration", min=0, metavar="SECONDS", help="Play only so much.", rich_help_panel=WHAT),
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topics", metavar="EXPR", help=f"Only these: {EXPRESSION}; may be repeated.", rich_help_panel=WHAT),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option("-x", "--exclude", metavar="EXPR", help="All but these; may be repeated.", rich_help_panel=WHAT),
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            "--remap",
            metavar="OLD:=NEW",
            help="Another name, such as viewer/1:=viewer/3, also inside the messages; may be repeated.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    rig: Annotated[
        str | None, typer.Option("--rig", metavar="NAME", help="As another rig.", rich_help_panel=WHAT, show_default=False)
    ] = None,
    pause: Annotated[bool, typer.Option("--pause", help="Begin paused; space goes on.", rich_help_panel=HOW)] = False,
    now: Annotated[
        bool,
        typer.Option(
            "--now",
            help="As if it were happening now: times moved to the present. For live services that have seen later times, "
            "and for displays of latency.",
            rich_help_panel=HOW,
        ),
    ] = False,
    delay: Annotated[
        float,
        typer.Option("--delay", min=0, max=3600, metavar="SECONDS", help="To be found by others, before it begins."),
    ] = 1.0,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Play nothing: recompute every derived message and compare it byte for byte.",
            rich_help_panel=CHECKING,
        ),
    ] = False,
    tolerance: Annotated[
        float,
        typer.Option(
            "--tolerance",
            min=0,
            max=1,
            help="By which numbers may differ, for a take of another kind of processor.",
            rich_help_panel=CHECKING,
        ),
    ] = 0.0,
    as_json: Annotated[
        bool, typer.Option("--json", help="With --verify, for programs: one JSON object.", rich_help_panel=CHECKING)
    ] = False,
    remote: Annotated[bool, typer.Option("--remote", hidden=True)] = False,
    certificates: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Of a secured rig, with what `zenocap certs RIG --service replay` makes; needs --mode client.",
            rich_help_panel=PANEL,
        ),
    ] = None,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """Play takes on the network: the same bytes on the same keys, at the recorded intervals.

    The replay stands in for the services whose messages it sends, and refuses when one of them is running. What was
    published before --start-offset and is kept for late joiners, such as calibrations, is sent first. In a terminal:
    space pauses, . makes one step, the arrows left and right jump 5 s, + and - change the rate, q quits. Exit status 3:
    played, but something of the take was cut or damaged.

    --verify needs no network: it feeds every service again what the take says it was fed, in that order, and compares what
    its step says with what was logged. Exit status 0: all equal; 1: something differs or is missing from the take, and the
    first difference is printed field by field; 3: equal, but not everything could be checked. Options for playing are not
    used then.

    Example: `zenocap replay monday.mcap`, or `zenocap replay monday.mcap --topics 'viewer/**'` to feed a live integrator
    """
    from dataclasses import replace

    from rich.console import Console

    from common.bus.access import REPLAY
    from common.runtime import logs
    from common.runtime.security import security_in
    from common.runtime.signals import stop_signals

    if verify:
        with one_line_errors():
            from services.takes.verify.shell import run_verify

            raise typer.Exit(run_verify(takes, tolerance, as_json, Console()))
    if tolerance or as_json:
        raise typer.BadParameter("--tolerance and --json go with --verify")
    with one_line_errors(), stop_signals() as stopped:
        from services.takes.replay.renaming import Renaming, parsed_rename
        from services.takes.replay.selection import Selection
        from services.takes.replay.shell import Wishes, run_replay

        try:
            selection = Selection(tuple(topics or ()), tuple(exclude or ()))
            renaming = Renaming(tuple(map(parsed_rename, remap or ())), rig)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
        console = Console()
        logs.configure("replay")
        wishes = Wishes(selection, renaming, start_offset, duration, rate, loop, pause, now, delay, remote)
        options = zenoh_options(None, mode, connect, listen, config, no_multicast_scouting)
        if certificates is not None:
            options = replace(options, security=security_in(certificates, REPLAY))
        try:
            raise typer.Exit(run_replay(takes, wishes, options, stopped, console))
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
