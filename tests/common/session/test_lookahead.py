"""Iterators advanced by threads: order, errors, bounded look-ahead, end."""

import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numba
import pytest

from tests.support.processes import ended, output_of, started, wait_until
from zenocap.common.session.lookahead import DEPTH, Lookahead, limited_threads


def numbers(count: int, error: Exception | None = None) -> Iterator[int]:
    yield from range(count)
    if error is not None:
        raise error


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_items_and_errors_arrive_as_from_the_iterator(jobs: int) -> None:
    with Lookahead(jobs) as lookahead:
        sources = [lookahead.ahead(numbers(100, ValueError("after 100"))) for _ in range(3)]
        assert [next(source) for _ in range(100) for source in sources] == [k for k in range(100) for _ in range(3)]
        for source in sources:
            with pytest.raises(ValueError, match="after 100"):
                next(source)
            assert list(source) == []


def test_at_most_depth_items_are_computed_ahead() -> None:
    computed: list[int] = []
    full, more = threading.Event(), threading.Event()

    def counted() -> Iterator[int]:
        for k in range(10 * DEPTH):
            computed.append(k)
            (full if len(computed) == DEPTH else more).set() if len(computed) >= DEPTH else None
            yield k

    with Lookahead(2) as lookahead:
        source = lookahead.ahead(counted())
        assert full.wait(60)
        assert not more.is_set()
        assert next(source) == 0
        assert more.wait(60)
    assert len(computed) == DEPTH + 1


def test_an_iterator_is_advanced_by_one_thread_at_a_time() -> None:
    inside = threading.Lock()

    class Exclusive(Iterator[int]):
        count = 0

        def __next__(self) -> int:
            assert inside.acquire(blocking=False)
            self.count += 1
            inside.release()
            return self.count

    with Lookahead(4) as lookahead:
        source = lookahead.ahead(Exclusive())
        assert [next(source) for _ in range(1000)] == list(range(1, 1001))


def test_threads_end_with_the_context_even_after_an_interruption() -> None:
    def interrupted() -> None:
        with Lookahead(3) as lookahead:
            next(lookahead.ahead(numbers(1000)))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("lookahead")]


def test_no_threads_for_one_job_and_none_below_one() -> None:
    source = numbers(3)
    with Lookahead(1) as lookahead:
        assert lookahead.ahead(source) is source
    with pytest.raises(ValueError, match="jobs: 0; allowed 1 or more"):
        Lookahead(0)


def test_thread_limits_hold_in_the_threads_ahead_and_are_restored() -> None:
    def limit() -> Iterator[int]:
        yield numba.get_num_threads()

    before = cv2.getNumThreads(), numba.get_num_threads()
    with limited_threads(1), Lookahead(2) as lookahead:
        assert (cv2.getNumThreads(), numba.get_num_threads()) == (1, 1)
        assert list(lookahead.ahead(limit())) == [1]
    assert (cv2.getNumThreads(), numba.get_num_threads()) == before


def test_an_iterator_may_consume_another_one_of_the_same_threads() -> None:
    with Lookahead(2) as lookahead:
        inner = lookahead.ahead(numbers(100))
        assert list(lookahead.ahead(2 * item for item in inner)) == [2 * item for item in range(100)]


def test_an_iterator_whose_threads_are_gone_ends_for_its_consumer() -> None:
    busy, ended = threading.Event(), threading.Event()

    def blocked() -> Iterator[int]:
        busy.wait(60)
        yield 0

    def consume(items: Iterator[int]) -> None:
        list(items)
        ended.set()

    with Lookahead(2) as lookahead:
        held = [lookahead.ahead(blocked()) for _ in range(2)]
        consumer = threading.Thread(target=consume, args=(lookahead.ahead(numbers(3)),))
        consumer.start()
        threading.Timer(0.2, busy.set).start()
    assert len(held) == 2
    assert ended.wait(60)
    consumer.join()


WAITS = """
import time
from zenocap.common.runtime.signals import stop_signals
from zenocap.common.session.lookahead import Lookahead

def items(stopped):
    print("begun", flush=True)
    while not stopped():
        time.sleep(0.01)
    yield "stopped"

with stop_signals() as stopped, Lookahead(2) as lookahead:
    print(*lookahead.ahead(items(stopped)))
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds threads in /proc")
@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGINT])
def test_a_consumer_that_waits_for_an_item_is_stopped(by: signal.Signals, tmp_path: Path) -> None:
    """It slept on when another thread received the signal, whose handler then waited for the item."""
    with started(["items"], tmp_path, zenocap=[sys.executable, "-P", "-c", WAITS]) as process:
        wait_until(lambda: "begun" in output_of(tmp_path), tmp_path, running=[process])
        assert ended(process, by) == 0
    assert output_of(tmp_path).split() == ["begun", "stopped"]
