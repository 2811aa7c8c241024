"""Work on independent items, shared among threads without an effect on the result.

Kernels release Python's global lock, so ordinary threads suffice.  None of the kernels is compiled with `parallel=True`:
numba's own threads, whose waiting would cost processor time, do no work.  Of numba there is only the number of threads.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numba


def in_threads(count: int, work: Callable[[int, int], None]) -> None:
    """Call `work` with first and last + 1 of equal ranges of `count`, one in each of numba's threads.

    numba's threads: all cores, or as set by `numba.set_num_threads`.
    """
    threads = max(1, min(numba.get_num_threads(), count))
    ends = [count * k // threads for k in range(threads + 1)]
    others = [_pool().submit(work, first, last) for first, last in pairwise(ends[1:])]
    work(0, ends[1])
    for other in others:
        other.result()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(thread_name_prefix="tracker")
