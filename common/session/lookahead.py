"""Iterators that threads advance ahead of their consumer, so that offline tracking uses all cores.

Decoding, OpenCV and compiled kernels release Python's global lock, so threads suffice.  Nothing is copied between
processes, Ctrl-C ends one process, and items and errors arrive in the order of a single thread.
"""

import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from threading import Condition
from types import TracebackType
from typing import Generic, Self, TypeVar

import cv2
import numba

from zenocap.common.runtime.signals import WAIT_S

T = TypeVar("T")

DEPTH = 4  # items ahead of the consumer, which bounds the images in memory; chosen by hand


def available_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def limited_threads(jobs: int) -> Iterator[None]:
    """Limit the other threads of this process within the context: OpenCV to one, the tracker's particles to `jobs`.

    OpenCV's own threads beside those of the views cost 5 % more processor time (seven views of 640x480, two cores).
    """
    before = cv2.getNumThreads(), numba.get_num_threads()
    cv2.setNumThreads(1)
    numba.set_num_threads(min(jobs, before[1]))
    try:
        yield
    finally:
        cv2.setNumThreads(before[0])
        numba.set_num_threads(before[1])


class Lookahead:
    """Threads for `ahead`; on leaving the context they end after their present items.

    jobs: number of threads; 1: none, and `ahead` returns its argument.
    """

    def __init__(self, jobs: int) -> None:
        """Raises ValueError for jobs below 1."""
        if jobs < 1:
            raise ValueError(f"jobs: {jobs}; allowed 1 or more")
        self._pool = None
        if jobs > 1:  # numba has a number of threads for each thread
            limit = (numba.get_num_threads(),)
            self._pool = ThreadPoolExecutor(jobs, "lookahead", numba.set_num_threads, limit)

    def ahead(self, items: Iterator[T]) -> Iterator[T]:
        """The same items and errors, computed up to DEPTH items ahead, by one thread at a time."""
        return items if self._pool is None else _Ahead(self._pool, items)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


class _Ahead(Generic[T], Iterator[T]):
    """An iterator advanced by the threads of a pool."""

    def __init__(self, pool: ThreadPoolExecutor, items: Iterator[T]) -> None:
        self._pool, self._items = pool, items
        self._ready: deque[T] = deque()
        self._error: BaseException | None = None  # raised after the last item
        self._ended = self._running = False
        self._changed = Condition()
        with self._changed:
            self._schedule()

    def __next__(self) -> T:
        with self._changed:
            while not self._ready and not self._ended:
                self._changed.wait(WAIT_S)
            if not self._ready:
                error, self._error = self._error or StopIteration(), None
                raise error
            item = self._ready.popleft()
            self._schedule()
            return item

    def _schedule(self) -> None:
        """Have the next item computed if there is room for it; the lock is held."""
        if not self._running and not self._ended and len(self._ready) < DEPTH:
            self._running = True
            self._pool.submit(self._advance).add_done_callback(self._end_if_cancelled)

    def _end_if_cancelled(self, future: Future[None]) -> None:
        """End when the pool is shut down, for an iterator that waits for this one in another thread of the pool."""
        if future.cancelled():
            with self._changed:
                self._running, self._ended = False, True
                self._changed.notify()

    def _advance(self) -> None:
        """Compute the next item, in a thread of the pool."""
        item: list[T] = []
        error: BaseException | None = None
        try:
            item.append(next(self._items))
        except StopIteration:
            pass
        except BaseException as failure:  # for the consumer
            error = failure
        with self._changed:
            self._running = False
            self._ready.extend(item)
            self._ended, self._error = not item, error
            try:
                self._schedule()
            except RuntimeError:  # the pool has been shut down
                self._ended = True
            self._changed.notify()
