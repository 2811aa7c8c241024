"""Log lines on standard error, coloured on a terminal; repeated events are logged once per source.

A message is one line: control characters are escaped, because texts of other programs and files are in it.
"""

import logging
import sys
from collections import Counter
from collections.abc import Callable
from time import monotonic
from types import TracebackType
from typing import TextIO

from rich.console import Console
from rich.logging import RichHandler

from zenocap.common.runtime.foreign_text import MAX_LINE, printable

MAX_SOURCES = 1000


class OneLineFormatter(logging.Formatter):
    """Escapes and cuts the message; the lines of a traceback are indented, so that none looks like another message."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        record.message = printable(record.message, MAX_LINE)
        return super().formatMessage(record)

    def formatException(
        self, ei: tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]
    ) -> str:
        return "\n".join(f"  {printable(line, MAX_LINE)}" for line in super().formatException(ei).splitlines())


def terminal_handler(console: Console, name: str = "") -> logging.Handler:
    """Handler that writes coloured lines to a terminal, each prefixed with `name`."""
    handler = RichHandler(console=console, show_path=False, log_time_format="%H:%M:%S", markup=False)
    handler.setFormatter(OneLineFormatter(f"{name}: %(message)s" if name else "%(message)s"))
    return handler


def configure(name: str, *, stream: TextIO | None = None) -> None:
    """Write log lines to `stream` (default: standard error), each prefixed with `name` ("viewer 1")."""
    stream = stream or sys.stderr
    handler: logging.Handler
    if stream.isatty():
        handler = terminal_handler(Console(file=stream), name)
    else:
        handler = logging.StreamHandler(stream)
        handler.setFormatter(OneLineFormatter(f"%(asctime)s %(levelname)s {name}: %(message)s"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.INFO)


class OncePerSource:
    """Counts events by source and kind and logs only the first of each; at most MAX_SOURCES sources are distinguished."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._counts: Counter[tuple[str, str]] = Counter()

    def warn(self, source: str, kind: str, text: str, *, trace: bool = False) -> None:
        """Log `text` if it is the first of this kind from this source.  trace: with the current exception's traceback."""
        entry = (printable(source), kind)
        if entry not in self._counts and len(self._counts) >= MAX_SOURCES:
            entry = ("other sources", kind)
        self._counts[entry] += 1
        if self._counts[entry] == 1:
            self._logger.warning("%s: %s (further ones are only counted)", entry[0], printable(text), exc_info=trace)

    def count(self, source: str, kind: str) -> int:
        return self._counts[(printable(source), kind)]


class OncePerInterval(logging.Handler):
    """Handler of a library's logger: one line per kind and interval, with the number since the last, without traceback.

    A kind is the message and the type of the exception, of which at most MAX_KINDS are distinguished.
    counts: records by kind.
    """

    MAX_KINDS = 32

    def __init__(self, logger: logging.Logger, interval_s: float, now_s: Callable[[], float] = monotonic) -> None:
        super().__init__()
        self._logger, self._interval_s, self._now_s = logger, interval_s, now_s
        self.counts: Counter[str] = Counter()
        self._logged: dict[str, tuple[float, int]] = {}  # time of the last line, and the count at that time

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        kind = record.msg if isinstance(record.msg, str) else type(record.msg).__name__
        if error is not None:
            kind = f"{kind}: {type(error).__name__}"
        if kind not in self.counts and len(self.counts) >= self.MAX_KINDS:
            kind = "other errors"
        self.counts[kind] += 1
        logged_s, before = self._logged.get(kind, (float("-inf"), 0))
        if self._now_s() - logged_s < self._interval_s:
            return
        self._logged[kind] = (self._now_s(), self.counts[kind])
        count = self.counts[kind] - before
        reason = "" if error is None else f": {printable(error)}"
        self._logger.warning(
            "%s%s (%d since the last such line; at most one every %g s)", printable(kind), reason, count, self._interval_s
        )
