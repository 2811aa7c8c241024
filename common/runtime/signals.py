"""SIGINT and SIGTERM as a question that loops ask."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stop_signals() -> Iterator[Callable[[], bool]]:
    """`stopped` for the body: true after SIGINT or SIGTERM.  A second signal ends the process the hard way."""
    event = threading.Event()
    signals = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.getsignal(number) for number in signals}

    def stop(_: int, __: FrameType | None) -> None:
        event.set()
        for number in signals:
            signal.signal(number, signal.SIG_DFL)

    for number in signals:
        signal.signal(number, stop)
    try:
        yield event.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
