"""The command that container engines and watchdogs ask: health."""

from typing import Annotated, Literal

import typer

from services.commands.options import (
    DONE,
    FAILED,
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    RigPath,
    one_line_errors,
    rig_at,
    zenoh_options,
)

Asked = Literal["router", "integrator", "viewer", "tracker", "recognizer", "animator"]


def health(
    rig: RigPath,
    service: Annotated[Asked, typer.Argument(metavar="SERVICE", help="Whom to ask.", show_default=False)],
    id: Annotated[str, typer.Option("--id", help="Which viewer.")] = "main",
    within: Annotated[float, typer.Option("--within", min=0.1, max=60.0, help="Seconds that it may take.")] = 5.0,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """Ask one service, over the network, whether it does its work: it answers once it has handled all that has come.

    A router is well when it lets a client in. Exit status 0 for well, 1 for no answer.

    Example: `zenocap health studio.toml viewer --id 1`
    """
    import time

    from common.bus.zenoh_bus import ZenohBus
    from common.runtime.clock import RealClock

    end_s = time.monotonic() + within
    with one_line_errors():
        one = rig_at(rig, files=False)
        name = f"viewer-{id}" if service == "viewer" else service
        options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting, name)
        with ZenohBus.open(options, one.name, RealClock(), lambda: time.monotonic() > end_s) as bus:
            if service != "router" and not bus.pace({(service, id)}, max(0.1, end_s - time.monotonic())):
                typer.echo(f"{service} {id} of rig {one.name} does not answer within {within:g} s", err=True)
                raise typer.Exit(FAILED)
    raise typer.Exit(DONE)
