"""Keys of a terminal, one by one as they are pressed; the terminal's mode is always restored."""

import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from types import FrameType
from typing import TextIO


class Key(Enum):
    PAUSE = "space"
    STEP = "."
    BACK = "left"
    AHEAD = "right"
    FASTER = "+"
    SLOWER = "-"
    QUIT = "q"


BY_BYTES = {
    b" ": Key.PAUSE,
    b".": Key.STEP,
    b"+": Key.FASTER,
    b"=": Key.FASTER,  # the same key without shift
    b"-": Key.SLOWER,
    b"q": Key.QUIT,
    b"\x1b[D": Key.BACK,
    b"\x1bOD": Key.BACK,
    b"\x1b[C": Key.AHEAD,
    b"\x1bOC": Key.AHEAD,
}
LONGEST = 64  # bytes of an unfinished sequence


def keys_in(data: bytes) -> tuple[list[Key], bytes]:
    """The keys pressed, and the bytes of an incomplete sequence.  Unknown keys are ignored."""
    found: list[Key] = []
    while data:
        size = _sequence(data)
        if size is None:
            return found, data[-LONGEST:]
        key = BY_BYTES.get(data[:size])
        if key is not None:
            found.append(key)
        data = data[size:]
    return found, b""


def _sequence(data: bytes) -> int | None:
    """Number of bytes of the first key; None when it is incomplete."""
    if data[0] != 0x1B:
        return 1
    if len(data) == 1:
        return None
    if data[1:2] == b"O":
        return 3 if len(data) > 2 else None
    if data[1:2] != b"[":
        return 1  # the escape key itself
    return next((k + 1 for k in range(2, len(data)) if 0x40 <= data[k] <= 0x7E), None)


class Keyboard:
    """fd: file descriptor of a terminal in cbreak mode; None without a terminal: no key is ever pressed."""

    def __init__(self, fd: int | None) -> None:
        self._fd = fd
        self._rest = b""

    def __bool__(self) -> bool:
        return self._fd is not None

    def pressed(self) -> list[Key]:
        """Keys pressed since the last call; never waits."""
        if self._fd is None or not select.select([self._fd], [], [], 0)[0]:
            return []
        data = os.read(self._fd, 1024)
        if not data:  # the terminal was closed
            self._fd = None
        keys, self._rest = keys_in(self._rest + data)
        return keys


@contextmanager
def keyboard(stream: TextIO = sys.stdin) -> Iterator[Keyboard]:
    """The keys of `stream` if it is a terminal that this process may read: no pipe, not in the background."""
    fd = _terminal(stream)
    if fd is None:
        yield Keyboard(None)
        return
    before = termios.tcgetattr(fd)

    def again(_: int, __: FrameType | None) -> None:
        tty.setcbreak(fd, termios.TCSANOW)  # after Ctrl-Z and fg: the shell has set its own mode

    handler = signal.signal(signal.SIGCONT, again)
    tty.setcbreak(fd, termios.TCSANOW)  # Ctrl-C still works, and keys typed earlier are not lost
    try:
        yield Keyboard(fd)
    finally:
        signal.signal(signal.SIGCONT, handler)
        termios.tcsetattr(fd, termios.TCSANOW, before)


def _terminal(stream: TextIO) -> int | None:
    try:
        fd = stream.fileno()
        return fd if os.isatty(fd) and os.tcgetpgrp(fd) == os.getpgrp() else None
    except (OSError, ValueError):
        return None
