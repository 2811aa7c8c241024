"""`zenocap`: the table of commands."""

import atexit
import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, NoReturn

import typer

from zenocap.common.errors import pip_install
from zenocap.tools.cli.suggestions import CommandGroup
from zenocap.tools.option_groups import add_command

UNWRITTEN = 120  # exit status, as of Python, where the last output could not be written
OPENING_OR_CLOSING = ("zenoh-open", "zenoh-close")  # threads of `common.bus.zenoh_session` that wait for a router
# Module in this folder of each command, or group of commands, by what its user does.
COMMANDS: Mapping[str, Mapping[str, str]] = {
    "Set up cameras and machines": {
        "setup": "setup", "cameras": "cameras", "calibrate": "calibrate.commands", "plan": "plan", "certs": "certs",
        "models": "models", "warmup": "up",
    },
    "Record takes": {
        "demo": "up", "up": "up", "film": "film", "sync": "sync", "track": "track", "record": "record",
    },
    "Look at takes, and convert them": {"show": "show", "render": "render", "export": "export", "replay": "replay"},
    "Judge takes, and repair them": {
        "info": "takes", "evaluate": "evaluate", "verify": "takes", "mirror": "takes", "recover": "takes",
    },
    "Operate rigs, service by service": {
        "doctor": "doctor", "top": "watch", "health": "watch", "metrics": "watch", "traces": "watch", "viewer": "viewer",
        "integrator": "services", "tracker": "services", "recognizer": "services", "animator": "services",
        "router": "services",
    },
    "Research": {"load": "load", "prior": "prior", "posture": "posture.commands"},
}  # fmt: skip
HELP = """Markerless human motion capture from ordinary fixed cameras, in real time, without neural network or GPU.

    `zenocap demo` runs it with a simulated person. For your own cameras: `zenocap setup studio`, or `zenocap cameras`,
    `zenocap calibrate`, a rig file, then `zenocap up studio.toml`; for videos `zenocap track`; for Blender, OpenSim and
    others `zenocap export`.

    Exit status: 0 done, 1 failed, 2 wrong usage, 3 done, with loss or doubt; of `track` also 4, done but unusable."""
# The extra that installs an optional module.
EXTRAS = {
    "cryptography": "certs", "ezc3d": "export", "hmmlearn": "training", "matplotlib": "plots",
    "prometheus_client": "metrics", "psutil": "load", "pyarrow": "tables", "pylsl": "lsl",
    "sklearn": "training", "threadpoolctl": "training",
    "xxhash": "ros",
}  # fmt: skip
NOT_IN_ALL = ("lsl", "tables")


def command_at(name: str) -> Callable[..., None] | typer.Typer:
    """A command, or a group of commands.  Raises KeyError for another name."""
    places = {name: module for group in COMMANDS.values() for name, module in group.items()}
    found: Callable[..., None] | typer.Typer = getattr(import_module(f"zenocap.tools.cli.{places[name]}"), name)
    return found


def program(words: Sequence[str] = ()) -> typer.Typer:
    """The command line; where the words begin with a command, with that one alone, for importing all takes time."""
    app = typer.Typer(
        name="zenocap", cls=CommandGroup, no_args_is_help=True, add_completion=False, rich_markup_mode="markdown",
        pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]}, help=HELP,
    )  # fmt: skip
    app.callback()(common_options)
    places = [(panel, name) for panel, group in COMMANDS.items() for name in group]
    for panel, name in [one for one in places if one[1] in words[:1]] or places:
        match command_at(name):
            case typer.Typer() as commands:
                app.add_typer(commands, name=name, rich_help_panel=panel)
            case command:
                add_command(app, command, panel=panel)
    return app


def _print_version(wanted: bool) -> None:
    if wanted:
        from zenocap.common.runtime.service_info import versions

        typer.echo(f"zenocap {versions()['zenocap']}")
        raise typer.Exit


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
    if all(thread.name not in OPENING_OR_CLOSING for thread in threading.enumerate()):
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
    if sys.stdin is None:  # closed by the caller: a question gets the end of the input, as from `</dev/null`
        sys.stdin = os.fdopen(os.open(os.devnull, os.O_RDONLY))
    elif isinstance(sys.stdin, TextIOWrapper):
        sys.stdin.reconfigure(errors="surrogateescape")  # what is not UTF-8 is a wrong answer
    try:
        program(sys.argv[1:])()
    except SystemExit as end:
        if isinstance(end.code, str):
            raise  # the interpreter prints it
        leave(end.code or 0)
    except ModuleNotFoundError as error:
        extra = EXTRAS.get((error.name or "").partition(".")[0])
        if extra is None:
            raise
        also = "" if extra in NOT_IN_ALL else ", or [all]"
        typer.echo(f"error: {error.name} is not installed here: {pip_install(extra)}{also}", err=True)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
