"""`zenocap top`: subscribes to the health of rigs from any machine of the network."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack

import msgspec
from rich.console import Console
from rich.live import Live

from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.observe.view import TROUBLE, RigView, ServiceRow, observed, rows
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.runtime.keyboard import Key, keyboard
from zenocap.common.topics import CAMERA_ADVICE, HEALTH
from zenocap.tools.monitor.display import as_json, shown, words

DONE, FAILED = 0, 1
ONCE_S = 2.5  # every service publishes its health once a second
SEARCH_S, REFRESH_S, LINE_S = 2.0, 0.25, 1.0
OWN_RIG = "zenocap-top"  # rig name of the connection itself, on which no service publishes


class Top:
    """One connection with a reader for each rig.  rigs: their services by name; empty for all rigs on the network."""

    def __init__(
        self, options: ZenohOptions, rigs: Mapping[str, Sequence[ServiceKey]], stopped: Callable[[], bool]
    ) -> None:
        """Open the connection.  Raises BusError, and ValueError for a bad name."""
        self._clock = RealClock()
        self._stack = ExitStack()
        self._own = self._stack.enter_context(ZenohBus.open(options, OWN_RIG, self._clock, stopped))
        self._search, self._searched_s = not rigs, -SEARCH_S
        self._readers: dict[str, ZenohBus] = {}
        self._views: dict[str, RigView] = {}
        for rig, services in rigs.items():
            self._read(rig, services)

    def __enter__(self) -> "Top":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _read(self, rig: str, services: Sequence[ServiceKey] = ()) -> None:
        self._views[rig] = RigView(rig, tuple(services))
        reader = self._readers[rig] = self._stack.enter_context(self._own.reader_of(rig))
        reader.subscribe(HEALTH)
        reader.subscribe(CAMERA_ADVICE)
        reader.watch_alive()

    def listen(self, seconds: float) -> None:
        """Receive events for a number of seconds, and find new rigs."""
        end_s = time.monotonic() + seconds
        while (now_s := time.monotonic()) < end_s:
            if self._search and now_s - self._searched_s >= SEARCH_S:
                self._searched_s = now_s
                for rig in sorted(self._own.rigs() - self._readers.keys()):
                    self._read(rig)
            for rig, reader in self._readers.items():
                while (event := reader.receive(0.0)) is not None:
                    self._views[rig] = observed(self._views[rig], event, self._clock.elapsed_ns())
            time.sleep(min(0.05, max(0.0, end_s - time.monotonic())))

    def rows(self) -> list[ServiceRow]:
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


def plain_line(row: ServiceRow) -> str:
    """One service as a line of text, without a terminal."""
    text = printable(f"{row.rig} {row.title}: {row.status}")
    if row.status in ("missing", "starting"):
        return text
    return f"{text} {row.rate:.1f}/s {row.cores:.2f} cores {row.memory_mb:.0f} MB lost {row.lost} | {printable(words(row))}"
