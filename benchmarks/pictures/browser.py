"""Chromium without a graphics card on the pages of zenocap: start, waits, processor time."""

import shutil
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_S = 90.0


@contextmanager
def served(words: Sequence[str], port: int) -> Iterator[tuple[Browser, str]]:
    """A browser, and the address of the page that a command of zenocap serves."""
    with sync_playwright() as driver:
        command = [sys.executable, "-P", "-m", "zenocap", *words]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            address = f"http://127.0.0.1:{port}/"
            await_page(address)
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            yield browser, address
            browser.close()
        finally:
            process.terminate()
            process.wait(30)


def await_page(address: str) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        try:
            urllib.request.urlopen(address, timeout=5).close()
            return
        except (urllib.error.URLError, OSError):
            time.sleep(0.2)
    raise TimeoutError(f"{address} was not served within {PATIENCE_S:g} s")


def await_pose(page: Page) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not page.evaluate("zenocap.state.count"):
        if time.monotonic() > end_s:
            raise TimeoutError(f"no pose within {PATIENCE_S:g} s")
        page.wait_for_timeout(100)
