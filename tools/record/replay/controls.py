"""Status and control of a replay: a terminal line, or JSON lines."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from time import monotonic
from typing import Annotated, TextIO

import msgspec
from msgspec import Meta
from rich.console import Console
from rich.live import Live
from rich.text import Text

from zenocap.common.runtime.keyboard import Key
from zenocap.tools.record.replay.player import Command, Status

REFRESH_S, LINE_S, JSON_LINE_S = 0.2, 5.0, 0.1  # between updates: on a terminal, elsewhere, for programs

HELP = "space pauses, . one step, ← → 5 s, + - rate, q quits"


def status_text(status: Status) -> str:
    """The status in one line."""
    done_s, all_s = (status.place_ns - status.begin_ns) / 1e9, (status.end_ns - status.begin_ns) / 1e9
    share = 100 * done_s / all_s if all_s > 0 else 100.0
    rate = f"rate {status.rate:g}" if status.rate else "as fast as consumers keep up"
    lap = f"  lap {status.lap}" if status.lap > 1 else ""
    state = "paused" if status.paused else "playing"
    return f"{done_s:7.1f} of {all_s:.1f} s  {share:3.0f} %  {rate}  {state}{lap}  {status.sent} messages"


@contextmanager
def display(console: Console, *, keys: bool) -> Iterator[Callable[[Status], None]]:
    """Yield a function that displays a status.  keys: also list the keys."""
    shown_s = monotonic()
    if not console.is_terminal:

        def print_line(status: Status) -> None:
            nonlocal shown_s
            if monotonic() >= shown_s + LINE_S:
                shown_s = monotonic()
                console.print(status_text(status), markup=False, highlight=False, soft_wrap=True)
                console.file.flush()

        yield print_line
        return
    with Live(console=console, auto_refresh=False) as live:

        def update(status: Status) -> None:
            nonlocal shown_s
            if monotonic() >= shown_s + REFRESH_S:
                shown_s = monotonic()
                line = Text(status_text(status), no_wrap=True, overflow="ellipsis")
                live.update(line.append(f"  ({HELP})", style="dim") if keys else line, refresh=True)

        yield update


class CommandLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A command as a line of JSON; None changes nothing.  place_s: seconds from the start of the replayed part."""

    paused: bool | None = None
    place_s: Annotated[float, Meta(ge=0, le=1e9)] | None = None
    rate: Annotated[float, Meta(gt=0, le=1000)] | None = None


class StatusLine(msgspec.Struct, frozen=True, kw_only=True):
    place_s: float
    duration_s: float
    rate: float
    paused: bool
    lap: int
    bad: int = 0
    shift_ns: int = 0
    shift_frames: int = 0


class Remote:
    """Commands from the lines of `stream`, read in a thread; its end is the command to quit."""

    def __init__(self, stream: TextIO = sys.stdin) -> None:
        self._stream = stream
        self._commands: SimpleQueue[Command | Key] = SimpleQueue()
        threading.Thread(target=self._read, name="remote", daemon=True).start()

    def pressed(self) -> list[Command | Key]:
        """Commands since the last call; never blocks."""
        found: list[Command | Key] = []
        while not self._commands.empty():
            command = self._commands.get()
            if found and isinstance(command, Command) and isinstance(before := found[-1], Command):
                found[-1] = before.followed_by(command)  # of the moves of a slider only the last one is made
            else:
                found.append(command)
        return found

    def _read(self) -> None:
        for line in self._stream:
            try:
                command = msgspec.json.decode(line, type=CommandLine)
            except (ValueError, RecursionError) as error:
                print(f"invalid command: {error}", file=sys.stderr, flush=True)
                continue
            place_ns = None if command.place_s is None else round(command.place_s * 1e9)
            self._commands.put(Command(command.paused, place_ns, command.rate))
        self._commands.put(Key.QUIT)


def status_lines(stream: TextIO = sys.stdout) -> Callable[[Status], None]:
    """Return a function that writes a status, at most every JSON_LINE_S seconds, and at once with another time shift."""
    written_s, shift_ns = 0.0, 0

    def write(status: Status) -> None:
        nonlocal written_s, shift_ns
        if monotonic() >= written_s + JSON_LINE_S or status.shift_ns != shift_ns:
            written_s, shift_ns = monotonic(), status.shift_ns
            write_status(status, stream)

    return write


def write_status(status: Status, stream: TextIO = sys.stdout) -> None:
    """One line of JSON."""
    line = StatusLine(
        place_s=(status.place_ns - status.begin_ns) / 1e9, duration_s=(status.end_ns - status.begin_ns) / 1e9,
        rate=status.rate, paused=status.paused, lap=status.lap, bad=status.bad, shift_ns=status.shift_ns,
        shift_frames=status.shift_frames,
    )  # fmt: skip
    stream.write(msgspec.json.encode(line).decode() + "\n")
    stream.flush()
