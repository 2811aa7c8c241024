"""Reading ahead in a thread of its own, so that a slow disk or a large chunk never delays what is due."""

import threading
from collections import deque
from collections.abc import Iterable
from time import monotonic

from services.takes.replay.laps import Ready

MAX_MESSAGES = 4096
MAX_BYTES = 16 << 20
REFILL = 0.5  # once full, reading goes on when this share is left


class Ahead:
    """A bounded buffer between an iterable, which its thread consumes, and one reader."""

    def __init__(self, source: Iterable[Ready]) -> None:
        self._source = source
        self._changed = threading.Condition()
        self._waiting: deque[Ready] = deque()
        self._bytes = 0
        self._closed = self._ended = False
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._read, name="read-ahead", daemon=True)
        self._thread.start()

    def peek(self, timeout_s: float = 0.0) -> Ready | None:
        """The next message, which stays; None when none came within `timeout_s`, or at the end.

        Raises what the source raised, after everything before it was taken.
        """
        end_s = monotonic() + timeout_s
        with self._changed:
            while not self._waiting and not self._ended:
                left_s = end_s - monotonic()
                if left_s <= 0:
                    return None
                self._changed.wait(left_s)
            if self._waiting:
                return self._waiting[0]
            if self._failure is not None:
                raise self._failure
            return None

    def take(self) -> None:
        """Let go of the next message."""
        with self._changed:
            self._bytes -= len(self._waiting.popleft().data)
            if len(self._waiting) <= REFILL * MAX_MESSAGES and self._bytes <= REFILL * MAX_BYTES:
                self._changed.notify_all()

    @property
    def ended(self) -> bool:
        """Nothing waits and nothing will come."""
        with self._changed:
            return self._ended and not self._waiting

    @property
    def buffered(self) -> tuple[int, int]:
        """Messages and bytes that wait."""
        with self._changed:
            return len(self._waiting), self._bytes

    def close(self) -> None:
        """End the thread; what waits is forgotten."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._bytes = 0
            self._changed.notify_all()
        self._thread.join(10.0)

    def _read(self) -> None:
        try:
            for ready in self._source:
                if not self._put(ready):
                    return
        except Exception as error:  # a file that has gone must reach the reader, not die with this thread
            self._failure = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _put(self, ready: Ready) -> bool:
        with self._changed:
            if len(self._waiting) >= MAX_MESSAGES or self._bytes + len(ready.data) > MAX_BYTES:
                self._changed.wait_for(lambda: self._closed or self._has_room(len(ready.data)))
            if self._closed:
                return False
            self._waiting.append(ready)
            self._bytes += len(ready.data)
            if len(self._waiting) == 1:
                self._changed.notify_all()
            return True

    def _has_room(self, size: int) -> bool:
        if not self._waiting:
            return True
        return len(self._waiting) <= REFILL * MAX_MESSAGES and self._bytes + size <= MAX_BYTES
