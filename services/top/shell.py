"""`zenocap top`: listens to the health of rigs, from any machine of the network."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack

import msgspec
from rich.console import Console
from rich.live import Live

from common.bus.protocol import Alive, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import RealClock
from common.runtime.keys import Key, keyboard
from common.runtime.rig import Rig
from common.topics import HEALTH
from services.top.display import as_json, shown
from services.top.table import TROUBLE, Network, Row, Service

DONE, FAILED = 0, 1
ONCE_S = 2.5  # every service says how it does once a second
SEARCH_S, REFRESH_S, LINE_S = 2.0, 0.25, 1.0
NOBODY = "zenocap-top"  # the rig of the connection itself, on which nobody speaks


def expected(rig: Rig) -> tuple[Service, ...]:
    """Services without which a rig gives no pose, or not all that its file asks for."""
    beside = {"tracker": rig.tracker, "recognizer": rig.recognizer}
    return (
        *(("viewer", viewer.id) for viewer in rig.viewers),
        ("integrator", "main"),
        *((name, "main") for name, spec in beside.items() if spec is not None),
    )


class Top:
    """One connection; a reader for each rig.  rigs: their services by name; empty for whatever is on the network."""

    def __init__(self, options: ZenohOptions, rigs: Mapping[str, Sequence[Service]], stopped: Callable[[], bool]) -> None:
        """Raises BusError, and ValueError for a bad name."""
        self._clock = RealClock()
        self._stack = ExitStack()
        self._own = self._stack.enter_context(ZenohBus.open(options, NOBODY, self._clock, stopped))
        self._network = Network(rigs)
        self._search, self._searched_s = not rigs, -SEARCH_S
        self._readers: dict[str, ZenohBus] = {}
        for rig in rigs:
            self._read(rig)

    def __enter__(self) -> "Top":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _read(self, rig: str) -> None:
        reader = self._readers[rig] = self._stack.enter_context(self._own.beside(rig))
        reader.subscribe(HEALTH)
        reader.watch_alive()

    def listen(self, seconds: float) -> None:
        """Take what comes for so long, and look for rigs that are new."""
        end_s = time.monotonic() + seconds
        while (now_s := time.monotonic()) < end_s:
            if self._search and now_s - self._searched_s >= SEARCH_S:
                self._searched_s = now_s
                for rig in sorted(self._own.rigs() - self._readers.keys()):
                    self._read(rig)
            for rig, reader in self._readers.items():
                while (event := reader.receive(0.0)) is not None:
                    if isinstance(event, Envelope | Alive):
                        self._network = self._network.heard(rig, event)
            time.sleep(min(0.05, max(0.0, end_s - time.monotonic())))

    def rows(self) -> list[Row]:
        return list(self._network.rows(self._clock.now_ns()))


def run_top(
    rigs: Mapping[str, Sequence[Service]], options: ZenohOptions, once: bool, json: bool, stopped: Callable[[], bool],
    console: Console,
) -> int:  # fmt: skip
    """Show until `stopped` or q; once: look once and end, with 1 when a service is missing, gone or silent.

    Raises BusError, and ValueError for a bad name.
    """
    with Top(options, rigs, stopped) as top:
        if json or once:
            top.listen(ONCE_S)
            rows = top.rows()
            if json:
                print(msgspec.json.encode(as_json(rows)).decode())
            else:
                console.print(shown(rows, ""))
            return FAILED if not rows or any(row.status in TROUBLE for row in rows) else DONE
        if console.is_terminal:
            _live(top, stopped, console)
        else:
            while not stopped():
                top.listen(LINE_S)
                console.print("\n".join(plain_line(row) for row in top.rows()) or "no service is there", markup=False)
    return DONE


def _live(top: Top, stopped: Callable[[], bool], console: Console) -> None:
    with keyboard() as keys, Live(console=console, screen=True, auto_refresh=False) as live:
        while not stopped() and Key.QUIT not in keys.pressed():
            top.listen(REFRESH_S)
            live.update(shown(top.rows(), "q or Ctrl-C ends"), refresh=True)


def plain_line(row: Row) -> str:
    """One service in one line, where there is no terminal."""
    words = f"{row.rig} {row.title}: {row.status}"
    if row.status in ("missing", "starting"):
        return words
    return f"{words} {row.rate:.1f}/s {row.cores:.2f} cores {row.memory_mb:.0f} MB lost {row.lost} | {row.words}"
