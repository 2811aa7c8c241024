"""Orders to a replay from the program that started it: JSON lines in, the status as JSON lines out."""

import sys
import threading
from collections.abc import Callable
from queue import SimpleQueue
from time import monotonic
from typing import Annotated, TextIO

import msgspec
from msgspec import Meta

from common.runtime.keys import Key
from services.takes.replay.player import Order, Status

LINE_S = 0.1


class OrderLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is None stays as it is.  place_s: from the beginning of what is replayed."""

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


class Remote:
    """Lines of `stream`, read in a thread; its end is the order to quit."""

    def __init__(self, stream: TextIO = sys.stdin) -> None:
        self._stream = stream
        self._orders: SimpleQueue[Order | Key] = SimpleQueue()
        threading.Thread(target=self._read, name="remote", daemon=True).start()

    def pressed(self) -> list[Order | Key]:
        """What was ordered since; never waits."""
        found: list[Order | Key] = []
        while not self._orders.empty():
            found.append(self._orders.get())
        return found

    def _read(self) -> None:
        for line in self._stream:
            try:
                said = msgspec.json.decode(line, type=OrderLine)
            except msgspec.MsgspecError as error:
                print(f"not an order: {error}", file=sys.stderr, flush=True)
                continue
            place_ns = None if said.place_s is None else round(said.place_s * 1e9)
            self._orders.put(Order(said.paused, place_ns, said.rate))
        self._orders.put(Key.QUIT)


def status_lines(stream: TextIO = sys.stdout) -> Callable[[Status], None]:
    """Writes the status it is told, now and then."""
    said_s = 0.0

    def say(status: Status) -> None:
        nonlocal said_s
        if monotonic() >= said_s + LINE_S:
            said_s = monotonic()
            write_status(status, stream)

    return say


def write_status(status: Status, stream: TextIO = sys.stdout) -> None:
    """One line of JSON."""
    line = StatusLine(
        place_s=(status.place_ns - status.begin_ns) / 1e9,
        duration_s=(status.end_ns - status.begin_ns) / 1e9,
        rate=status.rate,
        paused=status.paused,
        lap=status.lap,
        bad=status.bad,
    )
    stream.write(msgspec.json.encode(line).decode() + "\n")
    stream.flush()
