"""Prefetching in a thread, so that a slow disk or a large chunk does not delay messages that are due."""

import threading
from collections import deque
from collections.abc import Iterable
from time import monotonic

from zenocap.tools.record.replay.playlist import PreparedMessage

MAX_MESSAGES = 4096
MAX_BYTES = 16 << 20
FIRST_MESSAGES = 256  # before any is taken: a paused replay that is moved takes few, and nothing is decoded in vain
GROWTH = 8  # further ones for each that is taken, up to MAX_MESSAGES
REFILL = 0.5  # share left in a full buffer at which reading continues


class Prefetch:
    """Bounded buffer between an iterable, consumed by a thread, and one reader."""

    def __init__(self, source: Iterable[PreparedMessage]) -> None:
        self._source = source
        self._changed = threading.Condition()
        self._buffer: deque[PreparedMessage] = deque()
        self._bytes = self._taken = 0
        self._closed = self._ended = False
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._read, name="read-ahead", daemon=True)
        self._thread.start()

    def peek(self, timeout_s: float = 0.0) -> PreparedMessage | None:
        """Return the next message without removing it; None after `timeout_s`, or at the end.

        Raises the source's exception once all messages before it are taken.
        """
        end_s = monotonic() + timeout_s
        with self._changed:
            while not self._buffer and not self._ended:
                left_s = end_s - monotonic()
                if left_s <= 0:
                    return None
                self._changed.wait(left_s)
            if self._buffer:
                return self._buffer[0]
            if self._failure is not None:
                raise self._failure
            return None

    def take(self) -> None:
        """Remove the next message."""
        with self._changed:
            self._bytes -= len(self._buffer.popleft().data)
            self._taken += 1
            if len(self._buffer) <= REFILL * self._limit and self._bytes <= REFILL * MAX_BYTES:
                self._changed.notify_all()

    @property
    def _limit(self) -> int:
        """Messages in a full buffer."""
        return min(MAX_MESSAGES, FIRST_MESSAGES + GROWTH * self._taken)

    @property
    def ended(self) -> bool:
        """Whether the buffer is empty and the source exhausted."""
        with self._changed:
            return self._ended and not self._buffer

    @property
    def buffered(self) -> tuple[int, int]:
        """Number of messages and bytes in the buffer."""
        with self._changed:
            return len(self._buffer), self._bytes

    def close(self) -> None:
        """End the thread and drop the buffer."""
        with self._changed:
            self._closed = True
            self._buffer.clear()
            self._bytes = 0
            self._changed.notify_all()
        self._thread.join(10.0)

    def _read(self) -> None:
        try:
            for prepared in self._source:
                if not self._put(prepared):
                    return
        except Exception as error:  # raised again in the reader
            self._failure = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _put(self, prepared: PreparedMessage) -> bool:
        with self._changed:
            if len(self._buffer) >= self._limit or self._bytes + len(prepared.data) > MAX_BYTES:
                self._changed.wait_for(lambda: self._closed or self._has_room(len(prepared.data)))
            if self._closed:
                return False
            self._buffer.append(prepared)
            self._bytes += len(prepared.data)
            if len(self._buffer) == 1:
                self._changed.notify_all()
            return True

    def _has_room(self, size: int) -> bool:
        return not self._buffer or (len(self._buffer) <= REFILL * self._limit and self._bytes + size <= MAX_BYTES)
