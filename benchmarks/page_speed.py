"""The page in Chromium: load time, size of its scripts, pictures drawn per second and their processor time.

    python -m benchmarks.page_speed [--take walk.mcap] [--seconds 10] [--loads 3] [--size 1280x720] [--no-demo]

On a take (`zenocap show`) and on the demo (`zenocap up` with simulated cameras).  Chromium has no graphics card, so it
draws with the processor.  loaded: from the navigation until the page and its scripts are; first pose: until one is drawn.
Processor time is of all processes of the browser, with views and plots, per picture of the scene; it depends less on other
work than the rates do.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from benchmarks.page_pictures import await_page, await_pose
from playwright.sync_api import Browser, ViewportSize, sync_playwright

from benchmarks.animator import FLAGS
from benchmarks.table import Cell, table
from tests.support.places import GOLDEN
from tests.system.test_animator import rig_file
from zenocap.tools.launcher.peer_mesh import free_ports

CLOCK_TICKS = os.sysconf("SC_CLK_TCK")
SETTLED_MS = 3000  # before pictures are counted
COUNT_PICTURES = """() => {
  const scene = zenocap.scene, draw = scene.draw.bind(scene);
  window.pictures = 0;
  scene.draw = () => { window.pictures += 1; draw(); };
}"""
LOADED = """() => {
  const [navigation] = performance.getEntriesByType('navigation');
  const kind = (one) => new URL(one.name).pathname.split('.').pop();
  const files = performance.getEntriesByType('resource').filter((one) => ['js', 'css'].includes(kind(one)));
  const bytes = (name) => files.filter((one) => kind(one) === name).reduce((sum, one) => sum + one.decodedBodySize, 0);
  return {
    loaded_ms: navigation.loadEventEnd, html: navigation.decodedBodySize, js: bytes('js'), css: bytes('css'),
    scripts: files.filter((one) => kind(one) === 'js').length,
  };
}"""


@dataclass(frozen=True)
class Visit:
    """One opening of the page.  cpu_ms: of the browser per picture; shares: pictures and poses per second."""

    loaded_ms: float
    first_pose_ms: float
    pictures_s: float
    poses_s: float
    cpu_ms: float
    sizes: dict[str, int]


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


def visit(browser: Browser, address: str, size: ViewportSize, seconds: float) -> Visit:
    page = browser.new_page(viewport=size)
    begun_s = time.monotonic()
    page.goto(address)
    await_pose(page)
    first_pose_ms = 1e3 * (time.monotonic() - begun_s)
    loaded = page.evaluate(LOADED)
    page.evaluate(COUNT_PICTURES)
    page.wait_for_timeout(SETTLED_MS)
    count = "[window.pictures, zenocap.state.count]"
    before, used_s, begun_s = page.evaluate(count), browser_cpu_s(), time.monotonic()
    page.wait_for_timeout(1e3 * seconds)
    after, used_s, taken_s = page.evaluate(count), browser_cpu_s() - used_s, time.monotonic() - begun_s
    page.close()
    pictures, poses = after[0] - before[0], after[1] - before[1]
    sizes = {name: int(loaded[name]) for name in ("html", "js", "css", "scripts")}
    return Visit(
        loaded["loaded_ms"], first_pose_ms, pictures / taken_s, poses / taken_s, 1e3 * used_s / max(1, pictures), sizes
    )


@contextmanager
def served(arguments: list[str], port: int) -> Iterator[str]:
    """Address of the page of a command."""
    command = [sys.executable, "-P", "-m", "zenocap", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        address = f"http://127.0.0.1:{port}/"
        await_page(address)
        yield address
    finally:
        process.terminate()
        process.wait(60)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--take", type=Path, default=GOLDEN / "arms.mcap", help="Default: a short take of the tests.")
    parser.add_argument("--seconds", type=float, default=10.0, help="Of counting pictures, per visit.")
    parser.add_argument("--loads", type=int, default=3, help="Visits of each page.")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--no-demo", action="store_true", help="The take only.")
    options = parser.parse_args()
    width, height = (int(part) for part in options.size.split("x"))
    rows: list[list[Cell]] = []
    sizes: dict[str, int] = {}
    with TemporaryDirectory() as folder, sync_playwright() as driver:
        ports = free_ports(2)
        commands = {"take": ["show", str(options.take), "--port", str(ports[0])]}
        if not options.no_demo:
            commands["demo"] = ["up", str(rig_file(Path(folder), ports[1], "auto"))]
        for (name, arguments), port in zip(commands.items(), ports, strict=False):
            with served(arguments, port) as address:
                browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
                browser.new_page().close()  # the browser's own start is not the page's
                size: ViewportSize = {"width": width, "height": height}
                visits = [visit(browser, address, size, options.seconds) for _ in range(options.loads)]
                browser.close()
            sizes = visits[0].sizes
            for what, values in (
                ("loaded, ms", [one.loaded_ms for one in visits]),
                ("first pose, ms", [one.first_pose_ms for one in visits]),
                ("poses received/s", [one.poses_s for one in visits]),
                ("pictures drawn/s", [one.pictures_s for one in visits]),
                ("processor time a picture, ms", [one.cpu_ms for one in visits]),
            ):
                worst = min(values) if what.endswith("/s") else max(values)
                rows.append([name, what, len(values), float(np.median(values)), worst])
    load = os.getloadavg()[0]
    title = f"The page at {options.size} in Chromium without a graphics card; load of the machine {load:.1f}"
    print(table(title, ["page", "what", "visits", "median", "worst"], rows))
    print(f"{sizes['scripts']} scripts, {sizes['js'] / 1e3:.1f} kB; style {sizes['css'] / 1e3:.1f} kB; ", end="")
    print(f"HTML {sizes['html'] / 1e3:.1f} kB; no other file")


if __name__ == "__main__":
    main()
