"""The command that sends traces of a rig to an OpenTelemetry collector: traces."""

from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.options import DONE, FAILED, LOSS, one_line_errors, rig_at
from zenocap.tools.service_arguments import ZenohArguments

DEFAULT_ENDPOINT = "http://127.0.0.1:4318/v1/traces"


def traces(
    rigs: Annotated[list[Path], typer.Argument(metavar="RIG...", help="Rig files or folders.", show_default=False)],
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
    publishes nothing; the rig needs no change. It runs until Ctrl-C. Needs pip install 'zenocap[traces]'.

    Exit status 1: no pose was received; 3: the collector did not take all.

    Example: `zenocap traces studio.toml --endpoint http://192.168.1.30:4318/v1/traces`
    """
    from urllib.parse import urlsplit

    from zenocap.common.errors import UserError
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
            raise UserError(f"no package {error.name}: pip install 'zenocap[traces]'") from error
        loaded = [rig_at(path, files=False) for path in rigs]
        sent, lost = run_traces([rig.name for rig in loaded], zenoh.options(loaded[0]), endpoint, every, stopped)
        typer.echo(f"{sent} frame sets traced, {lost} of their spans not taken by {endpoint}")
        if not sent:
            typer.echo("no pose was received: is the rig running, and reached (-m client -e its router)?", err=True)
            raise typer.Exit(FAILED)
        raise typer.Exit(LOSS if lost else DONE)
