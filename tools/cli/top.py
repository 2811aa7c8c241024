"""The command that watches a network: top."""

from typing import Annotated

import typer

from zenocap.tools.cli.options import JsonOption, RigPaths, one_line_errors, rig_at
from zenocap.tools.service_arguments import ZenohArguments


def top(
    rigs: RigPaths = None, once: Annotated[bool, typer.Option("--once", help="Print the table once and exit.")] = False,
    json: JsonOption = False, *, zenoh: ZenohArguments,
) -> None:  # fmt: skip
    """Watch all services in this terminal: rates, latencies, losses.

    Of one rig or several; also clocks, memory and processor. Runs on any machine of the network and publishes nothing.
    Services that are gone, missing, or silent for three seconds are red. `lost`: messages and frames that a service has
    dropped or rejected since its start; after +: in the last second. It ends with q or Ctrl-C; --once and --json observe
    for 2.5 s, with exit status 1 when a service is red. What is wrong, and how to mend it: `zenocap doctor`.

    Examples: `zenocap top studio.toml`, `zenocap top -e tcp/192.168.1.2:7447 --once`
    """
    from rich.console import Console

    from zenocap.common.rig.services import services_of
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.operate.monitor.shell import run_top

    with one_line_errors(), stop_signals() as stopped:
        loaded = [rig_at(path, files=False) for path in rigs or ()]
        first = loaded[0] if loaded else None
        options = zenoh.options(first)
        services = {rig.name: services_of(rig, required=True) for rig in loaded}
        raise typer.Exit(run_top(services, options, once, json, stopped, Console()))
