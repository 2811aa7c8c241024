"""The command that watches a network: top."""

from pathlib import Path
from typing import Annotated

import typer

from services.commands.options import (
    ConfigOption,
    ConnectOption,
    JsonOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    one_line_errors,
    rig_at,
    zenoh_options,
)


def top(
    rigs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RIG...]", help="Rig files or folders; default: every rig that is there.", show_default=False
        ),
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="Look once, print, and end.")] = False,
    json: JsonOption = False,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """Every service of one rig or several, live: rates, latencies, losses, clocks, memory, processor.

    From any machine of the network; it only listens. What is gone, silent for three seconds or missing is red. `lost` is
    what a service dropped or refused since it started, and after + since a second ago. It ends with q or Ctrl-C;
    --once and --json look for 2.5 s and end, with exit status 1 when a service is not well.

    Examples: `zenocap top studio.toml`, `zenocap top -e tcp/192.168.1.2:7447 --once`
    """
    from rich.console import Console

    from common.runtime.signals import stop_signals
    from services.top.shell import expected, run_top

    with one_line_errors(), stop_signals() as stopped:
        loaded = [rig_at(path, files=False) for path in rigs or ()]
        first = loaded[0] if loaded else None
        options = zenoh_options(first, mode, connect, listen, config, no_multicast_scouting)
        services = {rig.name: expected(rig) for rig in loaded}
        raise typer.Exit(run_top(services, options, once, json, stopped, Console()))
