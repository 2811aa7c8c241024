"""Atomic replacement of files: after a crash or a full disk the old or the new one exists."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_atomically(path: Path, content: bytes, mode: int = 0o644, *, new: bool = False) -> None:
    """Write `content` to a temporary file beside `path`, sync it and the folder to disk, and rename it.  Raises OSError.

    mode: permissions of the file.  new: as `rename_new`, no file is replaced.
    """
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            os.fchmod(file.fileno(), mode)
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if new:
            rename_new(Path(name), path)
        else:
            os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def rename_new(file: Path, path: Path) -> None:
    """Rename a complete file within its disk.  Raises FileExistsError where there is a file at `path`, and OSError."""
    path.touch(exist_ok=False)  # takes the name, so that two programs never have the same one
    try:
        os.replace(file, path)
    except BaseException:
        path.unlink()
        raise


def free_names(path: Path, most: int) -> Iterator[Path]:
    """walk.bvh, walk-2.bvh and so on: a new file takes the first that none has."""
    yield path
    for number in range(2, most + 1):
        yield path.with_stem(f"{path.stem}-{number}")


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Context manager of a temporary path beside `path`, renamed to it at the end and removed after an error.

    The temporary path has the same suffix and is unique to this process.  The folder is created.  Raises OSError.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield unfinished
        with unfinished.open("rb") as file:
            os.fsync(file.fileno())
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Context manager of a path of the same name in a hidden folder beside `path`, renamed at the end as `rename_new`."""
    with tempfile.TemporaryDirectory(prefix=".zenocap-", dir=path.parent, ignore_cleanup_errors=True) as hidden:
        yield (unfinished := Path(hidden) / path.name)
        rename_new(unfinished, path)
