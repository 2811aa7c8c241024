"""The page in Chromium: load time, sizes, pictures drawn per second and their processor time.

On a take (`zenocap show`) and on the demo (`zenocap up` with simulated cameras).  Chromium has no graphics card, so it
draws with the processor.  Processor time is of all processes of the browser, with views and plots, per picture of the
scene; it depends less on other work than the rates do.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Browser

from benchmarks.cases.speed.browser import await_pose, browser_cpu_s, served
from benchmarks.harness.case import Case, Column, Figures, Kind, case
from tests.support.places import GOLDEN
from tests.system.test_animator import rig_file
from zenocap.tools.launcher.peer_mesh import free_ports

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


def run(one: Case) -> Figures:
    """One visit.  Options: seconds, of counting pictures."""
    (port,) = free_ports(1)
    with TemporaryDirectory() as folder:
        if one.film == "demo":
            words = ["up", str(rig_file(Path(folder), port, "auto"))]
        else:
            words = ["show", str(GOLDEN / "arms.mcap"), "--port", str(port)]
        with served(words, port) as (browser, address):
            browser.new_page().close()  # the browser's own start is not the page's
            return visit(browser, address, one.option("seconds", 10.0))


def visit(browser: Browser, address: str, seconds: float) -> dict[str, float]:
    """Figures of one opening of the page."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    begun_s = time.monotonic()
    page.goto(address)
    await_pose(page)
    first_pose_s = time.monotonic() - begun_s
    loaded = page.evaluate(LOADED)
    page.evaluate(COUNT_PICTURES)
    page.wait_for_timeout(SETTLED_MS)
    count = "[window.pictures, zenocap.state.count]"
    before, used_s, begun_s = page.evaluate(count), browser_cpu_s(), time.monotonic()
    page.wait_for_timeout(1e3 * seconds)
    after, used_s, taken_s = page.evaluate(count), browser_cpu_s() - used_s, time.monotonic() - begun_s
    page.close()
    pictures, poses = after[0] - before[0], after[1] - before[1]
    return {
        "loaded": loaded["loaded_ms"] / 1e3,
        "first pose": first_pose_s,
        "pictures": pictures / taken_s,
        "poses": poses / taken_s,
        "processor": used_s / max(1, pictures),
        "scripts": loaded["js"] / 1e3,
    }


PAGE = Kind(
    "page",
    "The page at 1280×720 in Chromium without a graphics card, on a take and on the demo; processor time of a picture of "
    "the scene.",
    run,
    (
        Column("loaded", "s", 1, joined="median"),
        Column("first pose", "s", 1, joined="median"),
        Column("pictures", "a second", 1, "low", "median"),
        Column("poses", "a second", 0, "low", "median"),
        Column("processor", "s a picture", 1, joined="median"),
        Column("scripts", "kB", 0, ""),
    ),
    {"take": case("take"), "demo": case("demo")},
    case("take", seconds=1.0),
    rows="page",
    timed=True,
)
