"""Log lines on standard error, coloured on a terminal; repeated events are logged once per source."""

import logging
import sys
from collections import Counter
from typing import TextIO

from rich.console import Console
from rich.logging import RichHandler

MAX_SOURCES = 1000


def configure(name: str, *, level: int = logging.INFO, stream: TextIO | None = None) -> None:
    """Write log lines to `stream` (default: standard error), each prefixed with `name` ("viewer 1")."""
    stream = stream or sys.stderr
    handler: logging.Handler
    if stream.isatty():
        handler = RichHandler(console=Console(file=stream), show_path=False, log_time_format="%H:%M:%S")
        handler.setFormatter(logging.Formatter(f"{name}: %(message)s"))
    else:
        handler = logging.StreamHandler(stream)
        handler.setFormatter(logging.Formatter(f"%(asctime)s %(levelname)s {name}: %(message)s"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)


class OncePerSource:
    """Counts events by source and kind and logs only the first of each; at most MAX_SOURCES sources are distinguished."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._counts: Counter[tuple[str, str]] = Counter()

    def warn(self, source: str, kind: str, text: str, *, trace: bool = False) -> None:
        """Log `text` if it is the first of this kind from this source.  trace: with the current exception's traceback."""
        entry = (source, kind)
        if entry not in self._counts and len(self._counts) >= MAX_SOURCES:
            entry = ("other sources", kind)
        self._counts[entry] += 1
        if self._counts[entry] == 1:
            self._logger.warning("%s: %s (further ones are only counted)", entry[0], text, exc_info=trace)

    def count(self, source: str, kind: str) -> int:
        return self._counts[(source, kind)]
