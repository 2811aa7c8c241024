"""Errors that a user can put right: base class, unreadable files, notes."""

import difflib
import shlex
import sys
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO


class UserError(Exception):
    """Wrong input or set-up.  The text names the file or option, the key, its value and what is allowed.

    The command line prints it as one line and exits with status 1; any other exception is a bug.  Subclasses exist only
    where code handles them differently.
    """


class SourceError(UserError):
    """Failure of a source of frames; the text names the source and the reason."""


class OpenError(SourceError):
    """The source does not exist, or is not a camera, video or picture."""


class AccessDenied(SourceError):
    """The source exists, but this user has no read permission."""


class SizeMismatch(SourceError):
    """The image size does not fit the calibration."""


class EndedEarly(SourceError):
    """The source ended or failed before its declared number of frames; the earlier frames are valid."""


class FileNote(UserWarning):
    """What is odd about a file that is read all the same, for `warnings.warn`; the command line shows it once as a line."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn an OSError of reading `path` into a UserError."""
    try:
        yield
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error


@contextmanager
def file_notes(show: Callable[[str], None]) -> Iterator[None]:
    """Call `show` with the text of each FileNote within the block, of equal ones once."""
    with warnings.catch_warnings():
        ordinary, seen = warnings.showwarning, set[str]()

        def shown(
            message: Warning | str, category: type[Warning], filename: str, lineno: int,
            file: TextIO | None = None, line: str | None = None,
        ) -> None:  # fmt: skip
            if not issubclass(category, FileNote):
                ordinary(message, category, filename, lineno, file, line)
            elif str(message) not in seen:
                seen.add(str(message))
                show(str(message))

        warnings.simplefilter("always", FileNote)
        warnings.showwarning = shown
        yield


def did_you_mean(text: str, known: Collection[str]) -> str:
    """Suggestion of the most similar known word, for the end of an error text; "" when none is similar."""
    similar = difflib.get_close_matches(text, list(known), 1)
    return f"; did you mean {similar[0]!r}?" if similar else ""


def pip_install(extra: str) -> str:
    """Command that installs an extra for the interpreter that runs: another one finds no zenocap, which is on no index."""
    return f"{shlex.quote(sys.executable)} -m pip install 'zenocap[{extra}]'"
