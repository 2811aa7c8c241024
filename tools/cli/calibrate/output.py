"""Output of the commands of `zenocap calibrate` that write a file."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from zenocap.common.atomic_write import free_names
from zenocap.common.errors import UserError
from zenocap.tools.cli.options import DONE, one_line_errors

POOR = 3  # exit status of a calibration with remarks
MOST_NAMES = 1000  # tried for a result whose name another file has taken; by hand

CalibrationOption = Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")]
LensesOption = Annotated[
    Path,
    typer.Option(
        help="Lenses of the cameras: any calibration, ROS camera_info, OpenCV, or a folder of these; a single lens is "
        "that of all cameras."
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")]


def check_new(output: Path, force: bool) -> None:
    """Refuse to overwrite a file without `force`: a calibration that is replaced is lost.  Raises UserError."""
    if output.exists() and not force:
        raise _exists(output)


@contextmanager
def writing(output: Path) -> Iterator[None]:
    """Turn an OSError of writing `output` into a UserError."""
    try:
        yield
    except FileExistsError as error:
        raise _exists(error.filename or output) from error
    except OSError as error:
        raise UserError(f"{output}: cannot be written: {error.strerror}") from error


def write_result(output: Path, force: bool, write: Callable[[Path, bool], object]) -> None:
    """Write what was computed since `check_new`.  write: is called with a path, and whether it must be new.

    A file that another program has made meanwhile stays: the result is beside it, and the UserError says where.
    """
    with writing(output):
        for path in free_names(output, MOST_NAMES):
            try:
                write(path, not force)
            except FileExistsError:
                if force or not path.parent.is_dir():  # a file is where the folder was to be
                    raise
                continue
            if path != output:
                raise UserError(f"{output}: exists since a moment ago, and stays: the result is in {path}")
            return
    raise _exists(output)


@contextmanager
def gathering(failures: list[UserError]) -> Iterator[None]:
    """Add the UserError of one output to `failures`: it loses no other one."""
    try:
        yield
    except UserError as error:
        failures.append(error)


def check_failures(failures: Sequence[UserError]) -> None:
    """Raise one UserError with the texts of all."""
    if failures:
        raise UserError("\n".join(map(str, failures)))


def _exists(path: Path | str) -> UserError:
    return UserError(f"{path}: exists already: allowed: another name, or --force")


def show(lines: Sequence[str], verdict: tuple[str, Sequence[str]]) -> int:
    """Print the report of a calibration, with its verdict: word and reasons; returns the exit status."""
    word, reasons = verdict
    typer.echo("\n".join(lines))
    typer.echo("\n  ".join([f"verdict: {word}", *reasons]))
    return POOR if word == "poor" else DONE


def finish(
    output: Path | None, lines: Sequence[str], verdict: tuple[str, Sequence[str]],
    data: Mapping[str, object] | None = None, failures: Sequence[UserError] = (),
) -> NoReturn:  # fmt: skip
    """Print the report of the calibration in `output`, or its data as JSON, and end the command.

    output: None where it could not be written there.  failures: to write files, which are said at the end.
    """
    if data is None:
        status = show(lines, verdict)
        if output is not None:
            typer.echo(f"next: zenocap calibrate check {output}")
    else:
        status = POOR if verdict[0] == "poor" else DONE
        typer.echo(json.dumps({**data, "written": None if output is None else str(output)}, indent=2))
    with one_line_errors():
        check_failures(failures)
    raise typer.Exit(status)
