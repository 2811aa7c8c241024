"""`zenocap`: the table of commands."""

import atexit
import os
import sys
import threading
from contextlib import suppress
from typing import Annotated, NoReturn

import typer

from zenocap.tools.cli import (
    animator,
    cameras,
    certs,
    doctor,
    evaluate,
    export,
    film,
    health,
    load,
    metrics,
    mirror,
    plan,
    recognizer,
    record,
    render,
    replay,
    services,
    setup,
    show,
    sync,
    takes,
    top,
    traces,
    track,
    up,
    verify,
    viewer,
)
from zenocap.tools.cli.calibrate.commands import calibrate
from zenocap.tools.cli.expansion import expanded
from zenocap.tools.cli.models import models
from zenocap.tools.cli.posture.commands import posture
from zenocap.tools.cli.prior import prior
from zenocap.tools.cli.suggestions import Commands

UNWRITTEN = 120  # exit status, as of Python, where the last output could not be written
OPENER = "zenoh-open"  # the thread of `common.bus.zenoh_session` that waits for a router

app = typer.Typer(
    name="zenocap",
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Markerless human motion capture from ordinary fixed cameras, in real time, without neural network or GPU.

    `zenocap demo` runs it with a simulated person. For your own cameras: `zenocap setup studio`, or `zenocap cameras`,
    `zenocap calibrate`, a rig file, then `zenocap up studio.toml`; for videos `zenocap track`; for Blender, OpenSim and
    others `zenocap export`.

    Exit status: 0 done, 1 failed, 2 wrong usage, 3 done with loss.""",
)

ON_THIS_MACHINE, SERVICES, FILES, BEFORE = "On this machine", "Single services", "Videos and takes", "Set-up"
NETWORK = "Network"
TABLE = (
    (ON_THIS_MACHINE, up.demo),
    (ON_THIS_MACHINE, up.up),
    (SERVICES, viewer.viewer),
    (SERVICES, services.integrator),
    (SERVICES, services.tracker),
    (SERVICES, recognizer.recognizer),
    (SERVICES, animator.animator),
    (SERVICES, services.router),
    (SERVICES, record.record),
    (NETWORK, top.top),
    (NETWORK, metrics.metrics),
    (NETWORK, traces.traces),
    (NETWORK, load.load),
    (NETWORK, plan.plan),
    (NETWORK, health.health),
    (FILES, film.film),
    (FILES, sync.sync),
    (FILES, track.track),
    (FILES, show.show),
    (FILES, render.render),
    (FILES, export.export),
    (FILES, takes.info),
    (FILES, mirror.mirror),
    (FILES, takes.recover),
    (FILES, replay.replay),
    (FILES, verify.verify),
    (FILES, evaluate.evaluate),
    (BEFORE, setup.setup),
    (BEFORE, cameras.cameras),
    (BEFORE, doctor.doctor),
    (BEFORE, certs.certs),
    (BEFORE, up.warmup),
)
# The extra that installs an optional module.
EXTRAS = {
    "cryptography": "certs", "ezc3d": "export", "hmmlearn": "training", "matplotlib": "plots",
    "prometheus_client": "metrics", "psutil": "load", "pyarrow": "tables", "pylsl": "lsl",
    "sklearn": "training", "threadpoolctl": "training",
    "xxhash": "ros",
}  # fmt: skip
NOT_IN_ALL = ("lsl", "tables")
for panel, command in TABLE:
    app.command(command.__name__, rich_help_panel=panel)(expanded(command))
app.add_typer(calibrate, name="calibrate", rich_help_panel=BEFORE)
app.add_typer(prior, name="prior", rich_help_panel=BEFORE)
app.add_typer(posture, name="posture", rich_help_panel=BEFORE)
app.add_typer(models, name="models", rich_help_panel=BEFORE)


def _print_version(wanted: bool) -> None:
    if wanted:
        from zenocap.common.runtime.service_info import versions

        typer.echo(f"zenocap {versions()['zenocap']}")
        raise typer.Exit


@app.callback()
def common_options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def leave(status: int) -> NoReturn:
    """End the process, without the interpreter's own ending: a thread of a library that waits for it then would abort it.

    Zenoh may still deliver a message after its session was closed, and cannot be stopped while it waits for a router.
    """
    if all(thread.name != OPENER for thread in threading.enumerate()):
        with suppress(KeyboardInterrupt):  # a second Ctrl-C
            threading._shutdown()  # type: ignore[attr-defined]  # waits for threads, as processes of multiprocessing do
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except OSError:
            status = status or UNWRITTEN
    os._exit(status)


def main() -> None:
    try:
        app()
    except SystemExit as end:
        if isinstance(end.code, str):
            raise  # the interpreter prints it
        leave(end.code or 0)
    except ModuleNotFoundError as error:
        extra = EXTRAS.get((error.name or "").partition(".")[0])
        if extra is None:
            raise
        also = "" if extra in NOT_IN_ALL else ", or [all]"
        typer.echo(f"error: {error.name} is not installed here: pip install 'zenocap[{extra}]'{also}", err=True)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
