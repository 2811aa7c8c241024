"""`zenocap top`: subscribes to the health of rigs from any machine of the network."""

import time
from collections.abc import Callable, Mapping, Sequence

import msgspec
from rich.console import Console
from rich.live import Live

from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.closable import Closable
from zenocap.common.observe.view import TROUBLE, ObservedService, RigView, observed, rows
from zenocap.common.observe.watch import Watch
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.runtime.keyboard import Key, keyboard
from zenocap.common.topics import CAMERA_ADVICE, HEALTH
from zenocap.tools.operate.monitor.display import as_json, shown, words

DONE, FAILED = 0, 1
ONCE_S = 2.5  # every service publishes its health once a second
REFRESH_S, LINE_S = 0.25, 1.0


class Top(Closable):
    """Views of one or several rigs.  rigs: their services by name; empty for all rigs on the network."""

    def __init__(
        self, options: ZenohOptions, rigs: Mapping[str, Sequence[ServiceKey]], stopped: Callable[[], bool]
    ) -> None:
        """Open the connection.  Raises BusError, and ValueError for a bad name."""
        self._clock = RealClock()
        self._watch = Watch(options, "top", rigs, (HEALTH, CAMERA_ADVICE), stopped)
        self._views = {rig: RigView(rig, tuple(services)) for rig, services in rigs.items()}

    def close(self) -> None:
        self._watch.__exit__()

    def listen(self, seconds: float) -> None:
        """Receive events for a number of seconds."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            for rig, event, at_ns in self._watch.events():
                self._views[rig] = observed(self._views.get(rig) or RigView(rig), event, at_ns)
            time.sleep(min(0.05, max(0.0, end_s - time.monotonic())))

    def rows(self) -> list[ObservedService]:
        """By rig and service."""
        now_ns = self._clock.elapsed_ns()
        return [row for _, view in sorted(self._views.items()) for row in rows(view, now_ns)]


def run_top(
    rigs: Mapping[str, Sequence[ServiceKey]], options: ZenohOptions, once: bool, json: bool, stopped: Callable[[], bool],
    console: Console,
) -> int:  # fmt: skip
    """Display until `stopped` or the key q.  once: display once; exit status 1 when a service is missing, gone or silent.

    Raises BusError, and ValueError for a bad name.
    """
    with Top(options, rigs, stopped) as top:
        if json or once:
            top.listen(ONCE_S)
            found = top.rows()
            if json:
                print(msgspec.json.encode(as_json(found)).decode())
            else:
                console.print(shown(found, ""))
            return FAILED if not found or any(row.status in TROUBLE for row in found) else DONE
        if console.is_terminal:
            _live(top, stopped, console)
        else:
            while not stopped():
                top.listen(LINE_S)
                console.print("\n".join(plain_line(row) for row in top.rows()) or "no service found", markup=False)
    return DONE


def _live(top: Top, stopped: Callable[[], bool], console: Console) -> None:
    with keyboard() as keys, Live(console=console, screen=True, auto_refresh=False) as live:
        while not stopped() and Key.QUIT not in keys.pressed():
            top.listen(REFRESH_S)
            live.update(shown(top.rows(), "q or Ctrl-C ends"), refresh=True)


def plain_line(row: ObservedService) -> str:
    """One service as a line of text, without a terminal."""
    text = printable(f"{row.rig} {row.title}: {row.status}")
    if row.status in ("missing", "starting"):
        return text
    return f"{text} {row.rate:.1f}/s {row.cores:.2f} cores {row.memory_mb:.0f} MB lost {row.lost} | {printable(words(row))}"
