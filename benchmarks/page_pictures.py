"""Screenshots of the page for the documentation: a real demo, or a take, in a real browser.

    python -m benchmarks.page_pictures [--folder docs] [--seconds 20]
    python -m benchmarks.page_pictures --take walk.mcap [--position 4]

Needs Chromium and playwright, and an idle machine: without a graphics card the browser is slow.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

from playwright.sync_api import Page, ViewportSize, sync_playwright

from benchmarks.animator import FLAGS
from tests.system.test_animator import rig_file
from zenocap.tools.launcher.peer_mesh import free_ports

SIZE: ViewportSize = {"width": 1440, "height": 900}
PATIENCE_S = 90.0


def main(folder: Path, seconds: float) -> None:
    with tempfile.TemporaryDirectory() as place, sync_playwright() as driver:
        (port,) = free_ports(1)
        command = [sys.executable, "-P", "-m", "zenocap", "up", str(rig_file(Path(place), port, "auto"))]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            address = f"http://127.0.0.1:{port}/"
            await_page(address)
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            page = browser.new_page(viewport=SIZE, color_scheme="dark")
            page.goto(address)
            page.click("[data-tab=setup]")
            page.wait_for_timeout(2000)
            page.click("#measure")
            page.wait_for_timeout(2500)
            page.screenshot(path=folder / "page-measure.png")
            page.click("#measure-cancel")
            page.click("[data-tab=view]")
            await_pose(page)
            page.wait_for_timeout(1000 * seconds)
            page.screenshot(path=folder / "page.png")
            browser.close()
        finally:
            process.terminate()
            process.wait(30)


def picture_of_take(take: Path, position_s: float, folder: Path) -> None:
    """page-take.png: a take beside its folder, paused at a position."""
    with sync_playwright() as driver:
        (port,) = free_ports(1)
        command = [sys.executable, "-P", "-m", "zenocap", "show", str(take), "--port", str(port)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            await_page(f"http://127.0.0.1:{port}/")
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            page = browser.new_page(viewport=SIZE, color_scheme="dark")
            page.goto(f"http://127.0.0.1:{port}/")
            await_pose(page)
            page.wait_for_timeout(8000)
            page.click("#pause")
            page.fill("#position", str(position_s))
            page.wait_for_timeout(5000)
            page.screenshot(path=folder / "page-take.png")
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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("docs"))
    parser.add_argument("--seconds", type=float, default=20.0, help="Tracking time before the screenshot (s).")
    parser.add_argument("--take", type=Path, help="A take beside the folder that it was tracked from: only its picture.")
    parser.add_argument("--position", type=float, default=4.0, help="In the take (s).")
    options = parser.parse_args()
    if options.take is None:
        main(options.folder, options.seconds)
    else:
        picture_of_take(options.take, options.position, options.folder)
