"""SIGINT and SIGTERM as a predicate that loops poll."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stop_signals(with_parent: bool = False) -> Iterator[Callable[[], bool]]:
    """Context of the predicate `stopped`: true after SIGINT or SIGTERM.  A second signal ends the process immediately.

    with_parent: true also when standard input, a pipe from the parent, is closed, so that no child outlives it.
    """
    event = threading.Event()
    if with_parent:
        threading.Thread(target=_until_closed, args=(event,), name="parent", daemon=True).start()
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


def _until_closed(event: threading.Event) -> None:
    while os.read(0, 4096):
        pass
    event.set()
