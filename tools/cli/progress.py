"""Progress of long work on standard error: a bar on a terminal, else lines, or JSON lines."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from rich.console import Console

LINE_S = 10.0  # between lines where there is no terminal
BAR_AFTER_S = 2.0  # work shorter than this shows no bar
REFRESH_S = 0.2  # between updates of the bar, and between lines for programs


class WorkProgress:
    """State of the work, updated by it.  unit: what `done` and `total` count; "bytes" are printed as megabytes."""

    def __init__(self, activity: str, unit: str = "frames", total: int | None = None) -> None:
        self.activity, self.unit, self.total, self.done, self.note = activity, unit, total, 0, ""
        self._start_s = monotonic()
        self._first: tuple[float, int] | None = None  # time and count of the first update: compilation comes before it

    def update(self, done: int, total: int | None = None, note: str = "") -> None:
        """Set the number of units done, their total where it is known by now, and the state in words."""
        self.done, self.note = done, note
        self.total = self.total if total is None else total
        if self._first is None:
            self._first = monotonic(), done

    def restart(self, activity: str, total: int | None = None) -> None:
        """Begin another part of the work; rate and remaining time are its own."""
        self.activity, self.total, self.done, self.note = activity, total, 0, ""
        self._start_s, self._first = monotonic(), None

    @property
    def elapsed_s(self) -> float:
        return monotonic() - self._start_s

    @property
    def rate(self) -> float | None:
        """Units per second since the first update; None until it is known."""
        if self._first is None or self.done <= self._first[1]:
            return None
        span_s = monotonic() - self._first[0]
        return (self.done - self._first[1]) / span_s if span_s > 0 else None

    @property
    def remaining_s(self) -> float | None:
        """Estimated time to the end; None until rate and total are known."""
        rate = self.rate
        return None if rate is None or self.total is None else max(0, self.total - self.done) / rate

    def line(self) -> str:
        """Done of total, rate, remaining time and state, as far as they are known."""
        scale, unit = (1e6, "MB") if self.unit == "bytes" else (1.0, self.unit)
        parts = []
        if self.done or self.total:
            total = "" if self.total is None else f" of {self.total / scale:.0f}"
            parts.append(f"{self.done / scale:.0f}{total} {unit}")
        rate, remaining_s = self.rate, self.remaining_s
        parts += [f"{rate / scale:.1f}/s"] if rate is not None else []
        parts.append(f"{self.elapsed_s:.0f} s elapsed")
        parts += [f"{remaining_s:.0f} s remaining"] if remaining_s is not None else []
        return f"{self.activity}: {', '.join(parts)}{f'  ({self.note})' if self.note else ''}"


@contextmanager
def progress(
    activity: str, unit: str = "frames", total: int | None = None, *, remote: bool = False
) -> Iterator[WorkProgress]:
    """Show the progress of the enclosed work, which updates the object that is returned.

    activity: the work, such as "tracking".  A thread draws, so that work without updates, such as compilation, shows too.
    remote: print JSON lines with `done` and `total` instead.
    """
    from rich.console import Console

    console, state, ended = Console(stderr=True), WorkProgress(activity, unit, total), Event()
    show = _json_lines if remote else _bar if console.is_terminal else _lines
    thread = Thread(target=show, args=(state, ended, console), daemon=True)
    thread.start()
    try:
        yield state
    finally:
        ended.set()
        thread.join()


def _lines(state: WorkProgress, ended: Event, _: Console) -> None:
    while not ended.wait(LINE_S):
        typer.echo(state.line(), err=True)


def _json_lines(state: WorkProgress, ended: Event, _: Console) -> None:
    while not ended.wait(REFRESH_S):
        typer.echo(json.dumps({"done": state.done, "total": state.total}), err=True)


def _bar(state: WorkProgress, ended: Event, console: Console) -> None:
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bars

    if ended.wait(BAR_AFTER_S):
        return
    columns = (BarColumn(), TextColumn("{task.description}", markup=False))
    with Bars(*columns, console=console, transient=True, auto_refresh=False) as bars:
        task = bars.add_task(state.line(), total=state.total)
        while not ended.wait(REFRESH_S):
            bars.update(task, completed=state.done, total=state.total, description=state.line(), refresh=True)
