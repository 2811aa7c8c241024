"""Stop signals, as a predicate or an exception; stacks of threads; end of a service that hangs."""

import faulthandler
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

STACKS: signal.Signals | None = getattr(signal, "SIGUSR1", None)  # None on Windows
STDERR = 2
# Longest wait of a main thread, which handles the signals: one that another thread receives does not wake it; by hand
WAIT_S = 0.2
HANGS_S = 120.0  # without a health of a service, which sends one a second; longer than a kernel compiles; by hand
WATCH_S = 1.0  # between two looks at a service; by hand


def print_stacks_on_signal() -> None:
    """Print the stacks of all threads to standard error on STACKS, also when the process hangs."""
    if STACKS is not None:
        faulthandler.register(STACKS, STDERR)


_nothing_to_end, _gives_up = threading.Event(), threading.Event()


class GivenUp(BaseException):
    """A computation that a signal has ended, see `until_stopped`."""


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
def until_stopped(stopped: Callable[[], bool]) -> Iterator[None]:
    """Context that ends with GivenUp at once when `stopped` becomes true by a signal, for a computation without effects.

    Python handles signals in the main thread, between its own instructions; other threads only look at the beginning.
    """
    if threading.current_thread() is threading.main_thread():
        _gives_up.set()
    try:
        if stopped():
            raise GivenUp
        yield
    finally:
        _gives_up.clear()


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
        if _gives_up.is_set():
            raise GivenUp

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
def watched(hangs_s: float = HANGS_S) -> Iterator[None]:
    """Context in which SIGALRM ends a process, with all stacks, whose loop has not called `come_round` for hangs_s seconds.

    Without memory a call of a library may wait for ever, as for a thread that could not begin.  Time in which the thread
    of the watch did not run either, as in a suspended process, does not count.  On Windows nothing is watched.
    """
    watch = _Watch(hangs_s)
    _watches.append(watch)
    if hasattr(signal, "SIGALRM"):
        threading.Thread(target=watch.look, name="watch", daemon=True).start()
    try:
        yield
    finally:
        watch.closed = True
        _watches.remove(watch)


def come_round(loops: bool = True) -> None:
    """The loop of a service has come round, within `watched`.  loops: False: what follows has no loop."""
    for watch in _watches:
        watch.loops, watch.idle_s = loops, 0.0


@dataclass
class _Watch:
    hangs_s: float
    idle_s: float = 0.0
    loops: bool = False
    closed: bool = False

    def look(self) -> None:
        step_s = min(WATCH_S, self.hangs_s)
        while not self.closed:
            time.sleep(step_s)
            self.idle_s += step_s
            if self.loops and not self.closed and self.idle_s > self.hangs_s:
                faulthandler.dump_traceback(STDERR, all_threads=True)
                os.kill(os.getpid(), signal.SIGALRM)


_watches: list[_Watch] = []
