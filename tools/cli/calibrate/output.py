"""What commands of `zenocap calibrate` that write a file share."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import DONE

POOR = 3  # exit status of a calibration with remarks

CalibrationOption = Annotated[Path, typer.Option("-o", "--output", help="Calibration file.")]
LensesOption = Annotated[
    Path,
    typer.Option(
        help="Lenses of the cameras: any calibration, ROS camera_info, OpenCV, or a folder of these; a single lens is "
        "that of all cameras.",
        show_default=False,
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")]


def check_new(output: Path, force: bool) -> None:
    """Refuse to overwrite a file without `force`: a calibration that is replaced is lost.  Raises UserError."""
    if output.exists() and not force:
        raise UserError(f"{output}: exists already: allowed: another name, or --force")


@contextmanager
def writing(output: Path) -> Iterator[None]:
    """Turn an OSError of writing `output` into a UserError."""
    try:
        yield
    except OSError as error:
        raise UserError(f"{output}: cannot be written: {error.strerror}") from error


def show_verdict(lines: Sequence[str], verdict: tuple[str, Sequence[str]]) -> None:
    """Print the report of a calibration.  verdict: word and reasons."""
    word, reasons = verdict
    typer.echo("\n".join(lines))
    typer.echo("\n  ".join([f"verdict: {word}", *reasons]))


def status_of(verdict: tuple[str, Sequence[str]]) -> int:
    """Exit status of a calibration with that verdict."""
    return POOR if verdict[0] == "poor" else DONE
