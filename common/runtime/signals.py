"""Stop signals as a predicate that loops poll; stacks of threads; end of a service that hangs."""

import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STACKS: signal.Signals | None = getattr(signal, "SIGUSR1", None)  # None on Windows
STDERR = 2
# Longest wait of a main thread, which handles the signals: one that another thread receives does not wake it; by hand
WAIT_S = 0.2
HANGS_S = 60.0  # between two healths of a service, which sends one a second; chosen by hand


def print_stacks_on_signal() -> None:
    """Print the stacks of all threads to standard error on STACKS, also when the process hangs."""
    if STACKS is not None:
        faulthandler.register(STACKS, STDERR)


_nothing_to_end = threading.Event()
_watched = threading.Event()


@contextmanager
def loading(stopped: Callable[[], bool]) -> Iterator[None]:
    """Context in which the first signal of `stop_signals` ends the process at once, with status 0.

    For the start of a service: loading takes seconds, compiling a minute, and nothing has begun that is to be ended.
    """
    _nothing_to_end.set()
    try:
        if stopped():
            os._exit(0)
        yield
    finally:
        _nothing_to_end.clear()


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
        if _nothing_to_end.is_set():
            os._exit(0)
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


@contextmanager
def watched() -> Iterator[None]:
    """Context of a service that SIGALRM ends where its loop has not called `come_round` for HANGS_S.

    Without memory a call of a library may wait for ever, as for a thread that could not begin; this timer needs none.
    """
    _watched.set()
    try:
        yield
    finally:
        come_round(0.0)
        _watched.clear()


def come_round(seconds: float = HANGS_S) -> None:
    """Set the time until the next call, within `watched`; 0: there is none."""
    if sys.platform != "win32" and _watched.is_set():
        signal.setitimer(signal.ITIMER_REAL, seconds)
