"""Names of takes."""

from datetime import UTC, datetime
from pathlib import Path


def take_path(rig: str, folder: Path, now_ns: int) -> Path:
    """A file of the rig's name and the time, UTC, that does not exist."""
    return free_name(folder / f"{rig}-{datetime.fromtimestamp(now_ns // 10**9, UTC):%Y%m%dT%H%M%SZ}.mcap")


def free_name(path: Path) -> Path:
    """`path`, or with -2, -3 ... where it exists."""
    free, number = path, 2
    while _there(free):
        free, number = path.with_name(f"{path.stem}-{number}{path.suffix}"), number + 1
    return free


def _there(path: Path) -> bool:
    """Not where the folder may not be read: opening the file will say so."""
    try:
        return path.exists()
    except PermissionError:
        return False
