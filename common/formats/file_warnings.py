"""Warnings about files that are read: one line each, or with many files one line for all equal ones."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

logger = logging.getLogger(__name__)

Groups = dict[str, dict[Path, None]]
"""Files of each text, both in the order of the warnings."""

_groups: ContextVar[Groups | None] = ContextVar("groups", default=None)


def warn_of_file(path: Path, text: str) -> None:
    """Log a warning about a file, at once or at the end of `grouped_warnings`."""
    groups = _groups.get()
    if groups is None:
        logger.warning("%s: %s", path, text)
    else:
        groups.setdefault(text, {})[path] = None


@contextmanager
def grouped_warnings() -> Iterator[None]:
    """Log equal warnings about several files at the end, as one line with the first file and the number of further ones.

    Also after an error.  Of this thread only; within another such block, at the end of the outer one.
    """
    if _groups.get() is not None:
        yield
        return
    groups: Groups = {}
    token = _groups.set(groups)
    try:
        yield
    finally:
        _groups.reset(token)
        for text, files in groups.items():
            first, *others = files
            more = f" and {len(others)} more file{'s' if len(others) > 1 else ''}" if others else ""
            logger.warning("%s%s: %s", first, more, text)
