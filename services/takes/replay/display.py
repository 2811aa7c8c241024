"""Where a replay is: one line that changes on a terminal, elsewhere a plain line every few seconds."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.live import Live
from rich.text import Text

from services.takes.replay.player import Status

REFRESH_S, LINE_S = 0.2, 5.0

HELP = "space pauses, . one step, ← → 5 s, + - rate, q quits"


def words(status: Status) -> str:
    """The status in one line."""
    done_s, all_s = (status.place_ns - status.begin_ns) / 1e9, (status.end_ns - status.begin_ns) / 1e9
    share = 100 * done_s / all_s if all_s > 0 else 100.0
    rate = f"rate {status.rate:g}" if status.rate else "as fast as consumers keep up"
    lap = f"  lap {status.lap}" if status.lap > 1 else ""
    state = "paused" if status.paused else "playing"
    return f"{done_s:7.1f} of {all_s:.1f} s  {share:3.0f} %  {rate}  {state}{lap}  {status.sent} messages"


@contextmanager
def display(console: Console, *, keys: bool) -> Iterator[Callable[[Status], None]]:
    """Shows the status it is told.  keys: say which there are."""
    said_s = monotonic()
    if not console.is_terminal:

        def print_line(status: Status) -> None:
            nonlocal said_s
            if monotonic() >= said_s + LINE_S:
                said_s = monotonic()
                console.print(words(status), markup=False, highlight=False, soft_wrap=True)
                console.file.flush()

        yield print_line
        return
    with Live(console=console, auto_refresh=False) as live:

        def update(status: Status) -> None:
            nonlocal said_s
            if monotonic() >= said_s + REFRESH_S:
                said_s = monotonic()
                line = Text(words(status), no_wrap=True, overflow="ellipsis")
                live.update(line.append(f"  ({HELP})", style="dim") if keys else line, refresh=True)

        yield update
