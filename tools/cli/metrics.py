"""The command that exports figures of a network to Prometheus: metrics."""

from typing import Annotated

import typer

from zenocap.tools.cli.options import DONE, RigPaths, one_line_errors, rig_at
from zenocap.tools.service_arguments import ZenohArguments


def metrics(
    rigs: RigPaths = None,
    host: Annotated[str, typer.Option("--host", help="Local address to listen on; 0.0.0.0 for all.")] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="TCP port of /metrics; 0 for any free one.")] = 9464,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Serve the figures of `top` to Prometheus, for graphs and alerts.

    Of one rig or several: rates, latencies, losses, clocks, phases, disk. Runs on any machine of the network and publishes
    nothing. With rig files, services that are missing are exported as not up; without them, rigs and services are found on
    the network, up to a limit. It runs until Ctrl-C.

    Examples: `zenocap metrics studio.toml`, `zenocap metrics -e tcp/192.168.1.10:7447 --host 0.0.0.0`
    """
    from zenocap.common.rig.services import services_of
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.operate.metrics.shell import run_metrics

    logs.configure("metrics")
    with one_line_errors(), stop_signals() as stopped:
        loaded = [rig_at(path, files=False) for path in rigs or ()]
        options = zenoh.options(loaded[0] if loaded else None)
        run_metrics({rig.name: services_of(rig) for rig in loaded}, options, host, port, stopped)
        raise typer.Exit(DONE)
