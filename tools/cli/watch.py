"""Commands that watch rigs from any machine of their network: top, health, metrics, traces."""

from pathlib import Path
from typing import Annotated

import typer

from zenocap.common.errors import UserError, pip_install
from zenocap.common.rig.services import MAIN, OF_RIGS, file_name
from zenocap.tools.cli.options import DONE, FAILED, LOSS, JsonOption, RigPath, RigPaths, one_line_errors, rig_at
from zenocap.tools.service_arguments import ZenohArguments

NAMES = ("router", *OF_RIGS)
DEFAULT_ENDPOINT = "http://127.0.0.1:4318/v1/traces"


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


def health(
    rig: RigPath,
    service: Annotated[str, typer.Argument(metavar="SERVICE", help=f"One of {', '.join(NAMES)}.")],
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


def traces(
    rigs: Annotated[list[Path], typer.Argument(metavar="RIG...", help="Rig files or folders.")],
    endpoint: Annotated[
        str, typer.Option(metavar="URL", help="Collector or tracing program that takes OTLP over HTTP.")
    ] = DEFAULT_ENDPOINT,
    every: Annotated[int, typer.Option(min=1, metavar="N", help="Trace one frame set of N; 1 for all.")] = 30,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Send latencies of frame sets to OpenTelemetry, Jaeger or Tempo.

    Every traced frame set is one trace: the silhouette of each viewer from the capture of its frame on, then the tracker,
    or the integrator and the search of arms and legs with the two-view method. Runs on any machine of the network and
    publishes nothing; the rig needs no change. It runs until Ctrl-C. Needs the extra traces.

    Exit status 1: no pose was received; 3: the collector did not take all.

    Example: `zenocap traces studio.toml --endpoint http://192.168.1.30:4318/v1/traces`
    """
    from urllib.parse import urlsplit

    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals

    logs.configure("traces")
    with one_line_errors(), stop_signals() as stopped:
        parts = urlsplit(endpoint)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise UserError(f"--endpoint {endpoint}: allowed: an address such as {DEFAULT_ENDPOINT}")
        try:
            from zenocap.tools.operate.traces.export import run_traces
        except ModuleNotFoundError as error:
            raise UserError(f"no package {error.name}: {pip_install('traces')}") from error
        loaded = [rig_at(path, files=False) for path in rigs]
        sent, lost = run_traces([rig.name for rig in loaded], zenoh.options(loaded[0]), endpoint, every, stopped)
        typer.echo(f"{sent} frame sets traced, {lost} of their spans not taken by {endpoint}")
        if not sent:
            typer.echo("no pose was received: is the rig running, and reached (-m client -e its router)?", err=True)
            raise typer.Exit(FAILED)
        raise typer.Exit(LOSS if lost else DONE)
