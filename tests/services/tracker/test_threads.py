"""Work shared among threads has the results of one thread."""

from threading import get_ident

import numba
import pytest

from zenocap.services.tracker.threads import each_in_threads


@pytest.mark.parametrize("count", [0, 1, 2, 7, 40])
@pytest.mark.parametrize("threads", [1, 2])
def test_results_are_in_the_order_of_the_items(count: int, threads: int) -> None:
    before = numba.get_num_threads()
    numba.set_num_threads(min(threads, before))
    try:
        assert each_in_threads(range(count), lambda item: item * item) == [item * item for item in range(count)]
    finally:
        numba.set_num_threads(before)


def test_an_error_of_one_item_is_raised() -> None:
    def work(item: int) -> int:
        if item == 3:
            raise ValueError("three")
        return get_ident()

    with pytest.raises(ValueError, match="three"):
        each_in_threads(range(8), work)
