"""Work on independent items, shared among threads without an effect on the result.

Kernels release Python's global lock, so ordinary threads suffice.  None of the kernels is compiled with `parallel=True`:
numba's own threads, whose waiting would cost processor time, do no work.  Of numba there is only the number of threads.
"""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import TypeVar

import numba

Item = TypeVar("Item")
Result = TypeVar("Result")

RANGES = 4  # of the items for each thread: more of them wait less for a thread without a core; chosen by hand


def in_threads(count: int, work: Callable[[int, int], None]) -> None:
    """Call `work` with first and last + 1 of ranges that cover `count` items, in numba's number of threads.

    That is all cores, or as set by `numba.set_num_threads`.  The caller takes ranges too, all of them where the other
    threads get no core: under load it waits for at most the range that another thread has begun.
    """
    threads = min(numba.get_num_threads(), count)
    if threads <= 1:
        work(0, count)
        return
    ranges = min(count, RANGES * threads)
    waiting = deque(pairwise([count * k // ranges for k in range(ranges + 1)]))

    def work_on_ranges() -> None:
        while waiting:
            try:
                first, end = waiting.popleft()
            except IndexError:  # another thread has taken the last one
                return
            work(first, end)

    others = [_pool().submit(work_on_ranges) for _ in range(threads - 1)]
    work_on_ranges()
    for other in others:
        if not other.cancel():
            other.result()


def each_in_threads(items: Sequence[Item], work: Callable[[Item], Result]) -> list[Result]:
    """Results of `work` on each of independent items, in their order; see `in_threads`."""
    results: dict[int, Result] = {}

    def work_on(first: int, end: int) -> None:
        for k in range(first, end):
            results[k] = work(items[k])

    in_threads(len(items), work_on)
    return [results[k] for k in range(len(items))]


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(thread_name_prefix="tracker")
