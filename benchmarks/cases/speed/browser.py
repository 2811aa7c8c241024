"""Chromium without a graphics card on the pages of zenocap: start, waits, processor time."""

import os
import shutil
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
CLOCK_TICKS = os.sysconf("SC_CLK_TCK")
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


def processor_s(top: int, name: str = "") -> float:
    """Processor time of a process and all running ones below it, seconds.  name: those with it in their name only."""
    parents: dict[int, int] = {}
    times: dict[int, float] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            head, _, rest = (folder / "stat").read_text().rpartition(")")
        except OSError:
            continue  # it has just ended
        fields = rest.split()
        parents[int(folder.name)] = int(fields[1])
        if name in head:
            times[int(folder.name)] = (int(fields[11]) + int(fields[12])) / CLOCK_TICKS

    def is_below(pid: int) -> bool:
        while pid > 1 and pid != top:
            pid = parents.get(pid, 0)
        return pid == top

    return sum(used_s for pid, used_s in times.items() if is_below(pid))


def browser_cpu_s() -> float:
    """Processor time of the running Chromium processes that this process has started, seconds."""
    return processor_s(os.getpid(), "chrom")
