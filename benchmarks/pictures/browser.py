"""Chromium without a graphics card on the pages of zenocap: start, waits, processor time."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from playwright.sync_api import Browser, Page

from benchmarks.chaos.page_visitors import answers
from tests.support.browser import chromium

PATIENCE_S = 90.0


@contextmanager
def served(words: Sequence[str], port: int) -> Iterator[tuple[Browser, str]]:
    """A browser, and the address of the page that a command of zenocap serves."""
    with chromium() as browser:
        command = [sys.executable, "-P", "-m", "zenocap", *words]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            _await(lambda: answers(port), f"page on port {port}", lambda: time.sleep(0.2))
            yield browser, f"http://127.0.0.1:{port}/"
        finally:
            process.terminate()
            process.wait(30)


def await_true(page: Page, condition: str) -> None:
    _await(lambda: bool(page.evaluate(condition)), condition, lambda: page.wait_for_timeout(100))


def _await(condition: Callable[[], bool], what: str, pause: Callable[[], None]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end_s:
            raise TimeoutError(f"no {what} within {PATIENCE_S:g} s")
        pause()
