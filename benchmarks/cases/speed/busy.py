"""Processes that never wait, beside which something is measured."""

from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context


@contextmanager
def busy_processes(count: int) -> Iterator[None]:
    """Run processes that never wait."""
    processes = [get_context("spawn").Process(target=_spin, daemon=True) for _ in range(count)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.terminate()
            process.join()


def _spin() -> None:
    while True:
        pass
