"""Shared arguments, exit statuses, and user errors printed as one line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from zenocap.common.errors import UserError, file_notes, pip_install
from zenocap.common.rig.methods import AUTO, METHODS
from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.tools.cli.suggestions import WrongArgument, check_rig_path, check_take_path
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.pose_track import Bound
    from zenocap.common.rig.rig import Rig

PICTURES = (".png", ".jpg", ".pdf", ".svg")  # suffixes of plots
DONE, FAILED, USAGE, LOSS, UNUSABLE = 0, 1, 2, 3, 4
Variant = Literal["improved", "paper"]  # of the method two-view

RigPath = Annotated[
    Path, typer.Argument(metavar="RIG", help="Rig file (TOML), or folder with calibration.toml and videos/.")
]
RigPaths = Annotated[
    list[Path] | None, typer.Argument(metavar="[RIG...]", help="Rig files or folders; default: every rig on the network.")
]
TakePath = Annotated[Path, typer.Argument(metavar="TAKE", help="Take (MCAP file).")]
OutputOption = Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="File to write.")]
RawOption = Annotated[
    bool, typer.Option("--raw", help="Use the poses of the forward pass, also of a take that was tracked both ways.")
]
RemoteOption = Annotated[bool, typer.Option("--remote", hidden=True)]  # progress as JSON lines, for the page of a take
JointsOption = Annotated[
    Path | None,
    typer.Option(
        metavar="MAP.toml",
        help="Names of joints or markers in .bvh, .trc and .c3d that are not recognized: a table [joints] with lines such "
        'as RHip = "thigh_r".',
    ),
]
NoLogOption = Annotated[bool, typer.Option("--no-log", help="Record no take.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object, for programs.")]


@dataclass(frozen=True)
class FrameRange:
    """The options `--from` and `--until`: frame numbers, or seconds since frame 0; both ends belong to the range."""

    first: str | None = option(
        None, "First frame, such as 120, or its time, such as 2.5s.", "--from", metavar="FRAME|TIMEs"
    )
    last: str | None = option(None, "Last frame (inclusive), or its time.", "--until", metavar="FRAME|TIMEs")

    def bounds(self) -> tuple[Bound | None, Bound | None]:
        """First and last; None for an end that is not given.  Raises typer.BadParameter."""
        return bound("--from", self.first), bound("--until", self.last)


def method_option(help: str) -> Any:
    """Field of a dataclass that is `--method`: one of METHODS, also of a package, or auto; None without it."""
    metavar = "|".join((AUTO, *METHODS.own))
    return option(None, f"{help} Installed packages may bring others.", metavar=metavar, callback=_known_method)


def _known_method(name: str | None) -> str | None:
    """The name as given.  Raises typer.BadParameter."""
    allowed = (AUTO, *METHODS.names())
    if name not in (None, *allowed):
        raise typer.BadParameter(f"{name!r}: allowed: {', '.join(allowed)}")
    return name


def bound(option: str, text: str | None) -> Bound | None:
    """Parse a frame number, or seconds with "s"; None stays None.  Raises typer.BadParameter."""
    from zenocap.common.formats.pose_track import Bound

    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,12})|(\d{1,9}(?:\.\d{0,9})?)s", text)
    if not found:
        raise typer.BadParameter(f"{option} {text!r}: allowed: a frame number such as 120, or seconds such as 2.5s")
    return Bound(float(found[1]) if found[1] else float(found[2]), found[1] is None)


def rig_at(
    path: Path, *, files: bool, method: str | None = None, variant: str | None = None,
    cameras: Sequence[str] | None = None, background: str | None = None,
) -> Rig:  # fmt: skip
    """Load a rig.  files: whether its videos must be on this machine.  cameras, background: see `load_rig`.

    Raises UserError, WrongArgument for a take.
    """
    check_rig_path(path)
    from zenocap.common.rig.rig import load_rig

    return load_rig(path, method, variant, files=files, cameras=cameras, background=background)


def checked_take(path: Path) -> Path:
    """Return the path of a take.  Raises UserError, WrongArgument for a rig, a video or a folder."""
    check_take_path(path)
    return path


def take_folder(rig: Rig, path: Path, folder: Path | None) -> Path:
    """Folder of a rig's takes: `folder` if given, else as the rig file has it, or ./recordings for a folder of videos."""
    if folder is not None:
        return folder
    return Path(rig.log.folder) if path.is_dir() else rig.base / rig.log.folder


def echo(line: str, err: bool = False) -> None:
    """Print a line with names that others chose: of cameras, machines, files and postures."""
    typer.echo(printable(line, MAX_LINE), err=err)


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Print a UserError as one line on standard error and exit with status 1, of a WrongArgument with 2.

    An OSError of a file or the network, and a MemoryError, likewise.  Other exceptions are bugs and pass.  A FileNote is a
    line too, once for each text.
    """
    try:
        with file_notes(lambda text: echo(f"note: {text}", err=True)):
            yield
    except UserError as error:
        for line in f"error: {error}".split("\n"):
            echo(line, err=True)
        raise typer.Exit(USAGE if isinstance(error, WrongArgument) else FAILED) from None
    except MemoryError as error:  # of the machine, of its group, or by a limit of the process
        echo(f"error: out of memory: {str(error) or 'no more is allowed'}", err=True)
        raise typer.Exit(FAILED) from None
    except BrokenPipeError:
        raise  # of the standard output: `zenocap ... | head` ends without a line
    except OSError as error:
        place = "" if error.filename is None else f"{printable(error.filename)}: "
        echo(f"error: {place}{error.strerror or error}", err=True)
        raise typer.Exit(FAILED) from None


def refuse(wrong: Mapping[str, object]) -> None:
    """Raise typer.BadParameter with the first text whose condition is true: options that exclude each other."""
    for text, is_wrong in wrong.items():
        if is_wrong:
            raise typer.BadParameter(text)


def check_folder(path: Path | None) -> None:
    """Raise UserError where the folder of a file to write is missing."""
    if path is not None and not path.parent.is_dir():
        raise UserError(f"{path}: there is no folder {path.parent}: allowed: a file in a folder that exists")


def check_plot(path: Path | None) -> None:
    """Raise UserError for a picture of --plot that cannot be drawn, before anything is computed."""
    from importlib.util import find_spec

    if path is None:
        return
    if path.suffix.lower() not in PICTURES:
        raise UserError(f"--plot {path}: suffix {path.suffix!r}: allowed: {', '.join(PICTURES)}")
    if find_spec("matplotlib") is None:
        raise UserError(f"--plot needs matplotlib: {pip_install('plots')}")
    check_folder(path)


def camera_list(text: str | None) -> list[str] | None:
    """Names of cameras in a text with commas; None: all."""
    return None if text is None else [name for part in text.split(",") if (name := part.strip())]


def parsed_size(text: str) -> tuple[int, int]:
    """(width, height) px of "160x120".  Raises typer.BadParameter."""
    size = size_of(text)
    if size is None:
        raise typer.BadParameter(f"--size {text!r}: allowed: WIDTHxHEIGHT of 16 px or more, such as 160x120")
    return size


def size_of(text: str, least: int = 16, most: int = 99_999) -> tuple[int, int] | None:
    """(width, height) px of "160x120"; None for another text, or sides out of the range."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    sides = (int(found[1]), int(found[2])) if found else (0, 0)
    return sides if least <= min(sides) and max(sides) <= most else None


def smoothing(option: str, text: str) -> float | None:
    """Cut-off frequency in Hz of "6"; None of "off".  Raises typer.BadParameter."""
    if text == "off":
        return None
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{option} {text!r}: allowed: a frequency in Hz, such as 6, or off") from None
