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
from zenocap.tools.cli.models import models
from zenocap.tools.cli.posture.commands import posture
from zenocap.tools.cli.prior import prior
from zenocap.tools.cli.suggestions import CommandGroup
from zenocap.tools.option_groups import add_command

UNWRITTEN = 120  # exit status, as of Python, where the last output could not be written
OPENER = "zenoh-open"  # the thread of `common.bus.zenoh_session` that waits for a router

app = typer.Typer(
    name="zenocap",
    cls=CommandGroup,
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

SET_UP, RECORD, LOOK = "Set up cameras and machines", "Record takes", "Look at takes, and convert them"
JUDGE, OPERATE, RESEARCH = "Judge takes, and repair them", "Operate rigs, service by service", "Research"
TABLE = (
    (SET_UP, setup.setup),
    (SET_UP, cameras.cameras),
    (SET_UP, plan.plan),
    (SET_UP, certs.certs),
    (SET_UP, up.warmup),
    (RECORD, up.demo),
    (RECORD, up.up),
    (RECORD, film.film),
    (RECORD, sync.sync),
    (RECORD, track.track),
    (RECORD, record.record),
    (LOOK, show.show),
    (LOOK, render.render),
    (LOOK, export.export),
    (LOOK, replay.replay),
    (JUDGE, takes.info),
    (JUDGE, evaluate.evaluate),
    (JUDGE, verify.verify),
    (JUDGE, mirror.mirror),
    (JUDGE, takes.recover),
    (OPERATE, doctor.doctor),
    (OPERATE, top.top),
    (OPERATE, health.health),
    (OPERATE, metrics.metrics),
    (OPERATE, traces.traces),
    (OPERATE, viewer.viewer),
    (OPERATE, services.integrator),
    (OPERATE, services.tracker),
    (OPERATE, recognizer.recognizer),
    (OPERATE, animator.animator),
    (OPERATE, services.router),
    (RESEARCH, load.load),
)
GROUPS = (
    (SET_UP, "calibrate", calibrate),
    (SET_UP, "models", models),
    (RESEARCH, "prior", prior),
    (RESEARCH, "posture", posture),
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
    add_command(app, command, panel=panel)
for panel, name, group in GROUPS:
    app.add_typer(group, name=name, rich_help_panel=panel)


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
