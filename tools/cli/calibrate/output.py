"""What commands of `zenocap calibrate` that write a file share."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from zenocap.common.errors import UserError

POOR = 3  # exit status of a calibration with remarks

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
