"""The command that publishes the messages of takes again: replay."""

from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.frame_range import FrameRange
from zenocap.tools.cli.options import checked_take, one_line_errors
from zenocap.tools.service_arguments import PANEL, ZenohArguments

WHAT, HOW = "Messages", "Playback"
EXPRESSION = "a key expression such as 'viewer/**' or 'zenocap/*/integrator/bap'"


def replay(
    takes: Annotated[
        list[Path],
        typer.Argument(metavar="TAKE...", help="Takes (MCAP files), played one after another.", show_default=False),
    ],
    rate: Annotated[
        float,
        typer.Option(
            "-r",
            "--rate",
            min=0,
            max=1000,
            help="Speed relative to the recording; 0: as fast as the live services of the rig keep up.",
            rich_help_panel=HOW,
        ),
    ] = 1.0,
    loop: Annotated[
        bool, typer.Option("--loop", help="Repeat without end; times and frame numbers keep rising.", rich_help_panel=HOW)
    ] = False,
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topics", metavar="EXPR", help=f"Keys to publish: {EXPRESSION}; may be repeated.", rich_help_panel=WHAT
        ),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option("-x", "--exclude", metavar="EXPR", help="Keys to leave out; may be repeated.", rich_help_panel=WHAT),
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            "--remap",
            metavar="OLD:=NEW",
            help="Rename keys, such as viewer/1:=viewer/3, also inside messages; may be repeated.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            "--rig", metavar="NAME", help="Publish as the rig of this name.", rich_help_panel=WHAT, show_default=False
        ),
    ] = None,
    pause: Annotated[bool, typer.Option("--pause", help="Start paused; space continues.", rich_help_panel=HOW)] = False,
    now: Annotated[
        bool,
        typer.Option(
            "--now",
            help="Move times to the present: for live services that have received later times, and to show latency.",
            rich_help_panel=HOW,
        ),
    ] = False,
    delay: Annotated[
        float,
        typer.Option("--delay", min=0, max=3600, metavar="SECONDS", help="Time for discovery before the start (s)."),
    ] = 1.0,
    remote: Annotated[bool, typer.Option("--remote", hidden=True)] = False,
    certificates: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Certificates for a secured rig, from `zenocap certs RIG --service replay`; needs --mode client.",
            rich_help_panel=PANEL,
        ),
    ] = None,
    *,
    span: FrameRange,
    zenoh: ZenohArguments,
) -> None:
    """Publish the messages of takes on the network: the same bytes on the same keys, at the recorded intervals.

    To look at a take, use `zenocap show`; to recompute it, `zenocap verify`.

    The replay acts as the services whose messages it publishes, and does not start while one of them is running. Latched
    messages from before --from, such as calibrations, are published first. Times of --from and --until count from the
    take's first message. Keys in a terminal: space pauses, . makes one step, the arrows left and right jump 5 s, + and -
    change the rate, q quits. Exit status 3: played, but parts of the take were cut or damaged.

    Example: `zenocap replay monday.mcap`, or `zenocap replay monday.mcap --topics 'viewer/**'` for a live integrator
    """
    from dataclasses import replace

    from rich.console import Console

    from zenocap.common.bus.access import REPLAY
    from zenocap.common.rig.security import security_in
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals

    first, last = span.bounds()
    with one_line_errors(), stop_signals() as stopped:
        from zenocap.tools.replay.remap import Remapping, parsed_remap
        from zenocap.tools.replay.selection import Selection
        from zenocap.tools.replay.shell import ReplayOptions, run_replay

        for take in takes:
            checked_take(take)
        try:
            selection = Selection(tuple(topics or ()), tuple(exclude or ()))
            remapping = Remapping(tuple(map(parsed_remap, remap or ())), rig)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
        console = Console()
        logs.configure("replay")
        options = ReplayOptions(selection, remapping, first, last, rate, loop, pause, now, delay, remote)
        session = zenoh.options()
        if certificates is not None:
            session = replace(session, security=security_in(certificates, REPLAY))
        try:
            raise typer.Exit(run_replay(takes, options, session, stopped, console))
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error
