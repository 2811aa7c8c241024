"""What commands share: Zenoh's own options, exit statuses, and errors as one line."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

import typer

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.bus.security import Security
    from common.bus.zenoh_session import ZenohOptions
    from common.runtime.rig import Rig

DONE, FAILED, USAGE, LOSS = 0, 1, 2, 3
USER_ERRORS = (  # what a user can put right
    ("common.bus.protocol", "BusError"),
    ("common.camera.files", "CalibrationError"),
    ("common.camera.lines", "LinesError"),
    ("common.formats.trc", "FormatError"),
    ("common.runtime.rig", "RigError"),
    ("common.take.reading", "TakeError"),
    ("common.take.recording", "RecordingError"),
    ("services.animator.page.server", "PageError"),
    ("services.certificates.authority", "CertificateError"),
    ("services.load.plan", "LoadError"),
    ("services.load.plan", "PlanError"),
    ("services.recognizer.examples", "ExampleError"),
    ("services.recognizer.file", "PostureModelError"),
    ("services.recognizer.manifest", "ManifestError"),
    ("services.tracker.prior.file", "PriorError"),
    ("services.tracker.prior.training", "MotionError"),
    ("services.viewer.sources.frame", "SourceError"),
)
Method = Literal["two-view", "hybrid", "image-force", "particle-filter"]
METHODS: tuple[Method, ...] = get_args(Method)  # of this version

RigPath = Annotated[
    Path,
    typer.Argument(
        metavar="RIG", help="A rig file (TOML), or a folder with calibration.toml and videos/.", show_default=False
    ),
]
TakePath = Annotated[Path, typer.Argument(metavar="TAKE", help="A take: an MCAP file.", show_default=False)]
OutputOption = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE", help="The file to write.", show_default=False)
]
JsonOption = Annotated[bool, typer.Option("--json", help="For programs: one JSON object.")]
PANEL = "Zenoh (instead of the rig's own)"
ModeOption = Annotated[
    Literal["peer", "client", "router"] | None,
    typer.Option("-m", "--mode", help="How to take part: peer meets others directly.", rich_help_panel=PANEL),
]
ConnectOption = Annotated[
    list[str] | None,
    typer.Option(
        "-e",
        "--connect",
        metavar="ENDPOINT",
        help="Whom to call, such as tcp/192.168.1.2:7447; may be repeated.",
        rich_help_panel=PANEL,
    ),
]
ListenOption = Annotated[
    list[str] | None,
    typer.Option(
        "-l",
        "--listen",
        metavar="ENDPOINT",
        help="Where to be called, such as tcp/0.0.0.0:7447; may be repeated.",
        rich_help_panel=PANEL,
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option("-c", "--config", metavar="FILE", help="A Zenoh configuration (JSON5).", rich_help_panel=PANEL),
]
NoMulticastOption = Annotated[
    bool,
    typer.Option(
        "--no-multicast-scouting", help="Do not look for others by multicast; call and be called.", rich_help_panel=PANEL
    ),
]


def zenoh_options(
    rig: Rig | None,
    mode: Literal["peer", "client", "router"] | None,
    connect: list[str] | None,
    listen: list[str] | None,
    config: Path | None,
    no_multicast_scouting: bool,
    name: str = "reader",
) -> ZenohOptions:
    """The command line's options over the rig's zenoh table.  name: whose certificate it has, where the rig is secured.

    Raises RigError.
    """
    from common.bus.zenoh_session import ZenohOptions

    if rig is None:
        return ZenohOptions(mode, tuple(connect or ()), tuple(listen or ()), config, not no_multicast_scouting)
    table = rig.zenoh
    own = rig.base / table.config if table.config else None
    return ZenohOptions(
        mode or _mode(table.mode),
        tuple(connect or table.connect),
        tuple(listen or table.listen),
        config or own,
        table.multicast_scouting and not no_multicast_scouting,
        security([rig], name),
    )


def security(rigs: list[Rig], name: str) -> Security | None:
    """The certificates by which `name` takes part in the rigs; None where they are not secured.  Raises RigError."""
    from common.runtime.rig import RigError
    from common.runtime.security import security_of

    try:
        return security_of(rigs, name)
    except ValueError as error:
        raise RigError(str(error)) from error


def _mode(text: str) -> Literal["peer", "client", "router"]:
    match text:
        case "client" | "router":
            return text
        case _:
            return "peer"


def rig_at(path: Path, *, files: bool, method: str | None = None) -> Rig:
    """The rig, if this version has its method.  Raises RigError."""
    from common.runtime.rig import RigError, load_rig

    rig = load_rig(path, method, files=files)
    if rig.method not in METHODS:
        raise RigError(f"{path}: method = {rig.method!r}: allowed in this version: {', '.join(METHODS)}")
    return rig


def take_folder(rig: Rig, path: Path, folder: Path | None) -> Path:
    """Where a rig's takes go: `folder`, or what the rig file says, or ./recordings for a folder of videos."""
    if folder is not None:
        return folder
    return Path(rig.log.folder) if path.is_dir() else rig.base / rig.log.folder


@contextmanager
def one_line_errors() -> Iterator[None]:
    """What a user can put right becomes one line on standard error and exit status 1; the rest is a bug."""
    try:
        yield
    except Exception as error:
        if not isinstance(error, _user_errors()):
            raise
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(FAILED) from None


def _user_errors() -> tuple[type[Exception], ...]:
    """Of the modules that are loaded: who has not loaded one cannot have its error, and may lack what it needs."""
    loaded = ((sys.modules.get(module), name) for module, name in USER_ERRORS)
    found = (getattr(module, name) for module, name in loaded if module is not None)
    return tuple(kind for kind in found if isinstance(kind, type) and issubclass(kind, Exception))
