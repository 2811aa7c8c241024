"""The base class of errors that a user can put right."""

import difflib
from collections.abc import Collection


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


def did_you_mean(text: str, known: Collection[str]) -> str:
    """Suggestion of the most similar known word, for the end of an error text; "" when none is similar."""
    similar = difflib.get_close_matches(text, list(known), 1)
    return f"; did you mean {similar[0]!r}?" if similar else ""
