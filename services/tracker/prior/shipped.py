"""The priors that come with zenocap, by name."""

from pathlib import Path

from common.runtime import tracker_table
from services.tracker.prior.file import PriorError

FOLDER = tracker_table.PRIORS
SUFFIX = tracker_table.SUFFIX


def shipped_names() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}")))


def find_prior(text: str) -> Path:
    """The file that `text` names: a shipped prior's name, or a path from where the command runs.  Raises PriorError."""
    try:
        return tracker_table.find_prior(text, Path())
    except tracker_table.TrackerError as error:
        raise PriorError(str(error)) from None
