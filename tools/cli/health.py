"""The command that container engines and watchdogs ask: health."""

from typing import Annotated

import typer

from zenocap.common.rig.services import MAIN, OF_RIGS, file_name
from zenocap.tools.cli.options import DONE, FAILED, RigPath, one_line_errors, rig_at
from zenocap.tools.service_arguments import ZenohArguments

NAMES = ("router", *OF_RIGS)


def health(
    rig: RigPath,
    service: Annotated[str, typer.Argument(metavar="SERVICE", help=f"One of {', '.join(NAMES)}.", show_default=False)],
    id: Annotated[str, typer.Option("--id", help="Id of the viewer.")] = MAIN,
    within: Annotated[float, typer.Option("--within", min=0.1, max=60.0, help="Seconds that it may take.")] = 5.0,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Check whether one service works, for watchdogs and containers.

    The service replies over the network once it has handled all messages received so far; a router works when it accepts a
    client. Exit status 0 when it works, 1 without a reply.

    Example: `zenocap health studio.toml viewer --id 1`
    """
    import time

    from zenocap.common.bus.zenoh_bus import ZenohBus
    from zenocap.common.runtime.clock import RealClock

    if service not in NAMES:
        raise typer.BadParameter(f"SERVICE {service!r}: allowed: {', '.join(NAMES)}")
    end_s = time.monotonic() + within
    with one_line_errors():
        one = rig_at(rig, files=False)
        options = zenoh.options(one, file_name((service, id)))
        with ZenohBus.open(options, one.name, RealClock(), lambda: time.monotonic() > end_s) as bus:
            if service != "router" and not bus.wait_until_handled({(service, id)}, max(0.1, end_s - time.monotonic())):
                typer.echo(f"{service} {id} of rig {one.name} does not answer within {within:g} s", err=True)
                raise typer.Exit(FAILED)
    raise typer.Exit(DONE)
