"""Chromium without a graphics card on the pages of zenocap: start, waits, processor time."""

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.chaos.page_visitors import answers
from tests.support.browser import CHROMIUM, FLAGS

PATIENCE_S = 90.0


@contextmanager
def served(words: Sequence[str], port: int) -> Iterator[tuple[Browser, str]]:
    """A browser, and the address of the page that a command of zenocap serves."""
    with sync_playwright() as driver:
        command = [sys.executable, "-P", "-m", "zenocap", *words]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            await_page(port)
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            yield browser, f"http://127.0.0.1:{port}/"
            browser.close()
        finally:
            process.terminate()
            process.wait(30)


def await_page(port: int) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not answers(port):
        if time.monotonic() > end_s:
            raise TimeoutError(f"no page on port {port} within {PATIENCE_S:g} s")
        time.sleep(0.2)


def await_pose(page: Page) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not page.evaluate("zenocap.state.count"):
        if time.monotonic() > end_s:
            raise TimeoutError(f"no pose within {PATIENCE_S:g} s")
        page.wait_for_timeout(100)
