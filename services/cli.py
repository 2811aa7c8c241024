"""`zenocap`: the table of commands."""

from typing import Annotated

import typer

from services.commands import animator, certs, doctor, health, live, load, offline, recognizer, record, replay, takes, top
from services.commands.calibrate import calibrate
from services.commands.posture import posture
from services.commands.posture_act import act
from services.commands.prior import prior

app = typer.Typer(
    name="zenocap",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Human motion capture from ordinary fixed cameras, in real time, without neural network or GPU.

    `zenocap demo` shows it with a synthetic actor. For your own two cameras write a rig file, calibrate,
    and `zenocap up studio.toml`. Exit status: 0 done, 1 failed, 2 wrong usage, 3 done with loss.""",
)

ON_THIS_MACHINE, SERVICES, FILES, BEFORE = "On this machine", "One service", "Files", "Preparing"
NETWORK = "The network"
TABLE = (
    (ON_THIS_MACHINE, live.demo),
    (ON_THIS_MACHINE, live.up),
    (SERVICES, live.viewer),
    (SERVICES, live.integrator),
    (SERVICES, live.tracker),
    (SERVICES, recognizer.recognizer),
    (SERVICES, animator.animator),
    (SERVICES, live.router),
    (SERVICES, record.record),
    (NETWORK, top.top),
    (NETWORK, load.load),
    (NETWORK, health.health),
    (FILES, offline.track),
    (FILES, takes.export),
    (FILES, takes.info),
    (FILES, takes.recover),
    (FILES, replay.replay),
    (FILES, offline.evaluate),
    (BEFORE, doctor.doctor),
    (BEFORE, certs.certs),
    (BEFORE, offline.warmup),
)
# Which extra brings what is not installed everywhere.
EXTRAS = {
    "cryptography": "certs", "ezc3d": "export", "foxglove": "takes", "hmmlearn": "training", "matplotlib": "plots",
    "mcap": "takes", "numba": "viewer", "pylsl": "lsl", "scipy": "viewer", "sklearn": "training",
    "threadpoolctl": "training", "websockets": "animator", "zstandard": "takes",
}  # fmt: skip
for panel, command in TABLE:
    app.command(command.__name__, rich_help_panel=panel)(command)
app.add_typer(calibrate, name="calibrate", rich_help_panel=BEFORE)
app.add_typer(prior, name="prior", rich_help_panel=BEFORE)
posture.command()(act)
app.add_typer(posture, name="posture", rich_help_panel=BEFORE)


def _print_version(wanted: bool) -> None:
    if wanted:
        from common.runtime.versions import versions

        typer.echo(f"zenocap {versions()['zenocap']}")
        raise typer.Exit


@app.callback()
def common_options(
    version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Say it.")] = False,
) -> None:
    pass


def main() -> None:
    try:
        app()
    except ModuleNotFoundError as error:
        extra = EXTRAS.get((error.name or "").partition(".")[0])
        if extra is None:
            raise
        typer.echo(f"error: {error.name} is not installed here: pip install 'zenocap[{extra}]', or [all]", err=True)
        raise SystemExit(1) from None


if __name__ == "__main__":
    main()
