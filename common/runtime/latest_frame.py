"""A frame source in its own thread that provides only its newest frame."""

import logging
import threading
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from zenocap.common.bus.protocol import FrameLike

logger = logging.getLogger(__name__)


F = TypeVar("F", bound=FrameLike)


class NewestFrame(Generic[F]):
    """Reads an iterator in a thread; `take` returns the newest frame once, replaced frames are counted as dropped.

    announce: called after each frame and at the end, in that thread.
    """

    def __init__(self, source: Iterator[F], announce: Callable[[], None]) -> None:
        self._source = source
        self._announce = announce
        self._lock = threading.Lock()
        self._waiting: F | None = None
        self._given = self._dropped = 0
        self._ended = False
        self._stop = threading.Event()
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._read, name="frames", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def take(self) -> F | None:
        with self._lock:
            frame, self._waiting = self._waiting, None
            return frame

    @property
    def dropped(self) -> int:
        return self._dropped

    def counts(self) -> tuple[int, int]:
        """Frames that the source gave, without one that still waits, and those of them that were dropped."""
        with self._lock:
            return self._given - (self._waiting is not None), self._dropped

    @property
    def ended(self) -> bool:
        """Whether no frame is waiting and none will follow; `failure` is the reason if the source failed."""
        with self._lock:
            return self._ended and self._waiting is None

    def stop(self, timeout_s: float = 1.0) -> None:
        """Stop the thread; one that is blocked in a driver is abandoned and does not keep the process alive."""
        self._stop.set()
        if self._thread.ident is None:  # never started
            return
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            logger.warning("the frame source did not stop within %g s", timeout_s)

    def _read(self) -> None:
        try:
            for frame in self._source:
                if self._stop.is_set():
                    break
                with self._lock:
                    self._given += 1
                    self._dropped += self._waiting is not None
                    self._waiting = frame
                self._announce()
        except Exception as error:  # any error of a driver must reach the loop instead of ending this thread
            self.failure = error
        finally:
            close = getattr(self._source, "close", None)
            if callable(close):
                close()
            with self._lock:
                self._ended = True
            self._announce()
