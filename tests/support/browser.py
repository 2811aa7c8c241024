"""Pages in Chromium: start, visit without console errors, waiting for a state."""

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count, product
from pathlib import Path
from typing import TYPE_CHECKING, cast
from urllib.parse import urlsplit

import numpy as np
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# SwiftShader, a graphics card in software, draws the scene alone: with the whole page it takes several times as long.
FLAGS = [
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing",
]  # fmt: skip
WIDTHS, HEIGHT = (390, 1100, 1280, 1920), 844  # of the windows that every page is tried in
SCHEMES = "light", "dark"  # the last one is that of a visit
PATIENCE_S = 240.0  # time limit for reaching a state: only a hang reaches it


CONTRAST = 4.5  # of a text to what is behind it; WCAG 2, level AA
FAINT_TEXTS = """(least) => {
  const numbers = (text) => (text.match(/[\\d.]+/g) ?? []).map(Number);
  const colours = (text) => (text.match(/rgba?\\([^)]*\\)/g) ?? []).map(numbers).map(([r, g, b, a = 1]) => [r, g, b, a]);
  const over = ([r, g, b, a], back) => [r, g, b].map((value, k) => a * value + (1 - a) * back[k]);
  const linear = (value) => value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4;
  const light = (colour) => [0.2126, 0.7152, 0.0722].reduce((sum, weight, k) => sum + weight * linear(colour[k]), 0);
  const contrast = (one, other) => {
    const [dark, bright] = [light(one), light(other)].sort((a, b) => a - b);
    return (bright + 0.05) / (dark + 0.05);
  };
  const backs = (element) => {
    if (!element) return [colours(getComputedStyle(document.body).backgroundColor)[0].slice(0, 3)];
    const style = getComputedStyle(element), own = colours(style.backgroundColor)[0] ?? [0, 0, 0, 0];
    const gradient = style.backgroundImage === 'none' ? [] : colours(style.backgroundImage);
    if (own[3] === 1 && !gradient.length) return [own.slice(0, 3)];
    const behind = backs(element.parentElement).map((back) => over(own, back));
    return gradient.length ? behind.flatMap((back) => gradient.map((colour) => over(colour, back))) : behind;
  };
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement, text = walker.currentNode.textContent.trim();
    if (!text || element.closest('script, style, :disabled, option')) continue;
    if (!element.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
    const range = document.createRange();
    range.selectNodeContents(walker.currentNode);
    if (!range.getClientRects().length) continue;
    const style = getComputedStyle(element), ink = colours(element.closest('svg') ? style.fill : style.color)[0];
    if (!ink) continue;
    let alpha = 1;
    for (let one = element; one; one = one.parentElement) alpha *= Number(getComputedStyle(one).opacity);
    ink[3] *= alpha;
    const ratio = Math.min(...backs(element).map((back) => contrast(over(ink, back), back)));
    const name = `${element.tagName.toLowerCase()}#${element.id}.${element.className}`;
    if (ratio < least) found.push(`${ratio.toFixed(2)} ${name}: ${text.slice(0, 40)}`);
  }
  return found;
}"""


@contextmanager
def chromium() -> Iterator["Browser"]:
    """A running Chromium; skips the test where there is none, or no playwright to drive it."""
    driver = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine")
    with driver.sync_playwright() as api, api.chromium.launch(executable_path=CHROMIUM, args=FLAGS) as one:
        yield one


class Visit:
    """A page at an address.  requests: every URL that it requested.  problems: errors on its console.

    pictures: folder of pictures of every window that is checked, as `python -m benchmarks --pictures windows` writes them.
    """

    pictures: Path | None = None

    def __init__(self, page: "Page", address: str) -> None:
        self.page, self._home, self._checks = page, f"//{urlsplit(address).netloc}/", count(1)
        self.requests: list[str] = []
        self.problems: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda socket: self.requests.append(socket.url))
        page.on("pageerror", lambda error: self.problems.append(str(error)))
        page.on("console", lambda line: self.problems.append(line.text) if line.type == "error" else None)
        page.goto(address)

    @property
    def foreign(self) -> list[str]:
        """Requested URLs of other servers."""
        return [url for url in self.requests if self._home not in url and not url.startswith("data:")]

    def text(self, selector: str) -> str:
        return self.page.inner_text(selector)

    def evaluate(self, script: str) -> object:
        return self.page.evaluate(script)

    def until(self, condition: Callable[[], object], text: str) -> None:
        """Poll a condition from here: the page's policy forbids to evaluate it there."""
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > end_s:
                pytest.fail(f"not within {PATIENCE_S:g} s: {text}; {self.problems}; {self.text('body')[:500]}")
            self.page.wait_for_timeout(30)

    def check_windows(self) -> None:
        """In every window and colour scheme nothing is wider, and every text that is seen has contrast."""
        before, widths = self.page.viewport_size, "[innerWidth, Math.max(innerWidth, document.documentElement.scrollWidth)]"
        name = f"{re.split(r'::|[ [(]', os.environ['PYTEST_CURRENT_TEST'])[1]}-{next(self._checks)}"
        for width, scheme in product(WIDTHS, SCHEMES):
            self.page.set_viewport_size({"width": width, "height": HEIGHT})
            self.page.emulate_media(color_scheme=scheme)
            self.until(lambda width=width: self.evaluate(widths) == [width, width], f"a page that is {width} px wide")
            styles = [self.evaluate(f"getComputedStyle(document.body).{key}") for key in ("color", "backgroundColor")]
            ink, back = (np.array(re.findall(r"[\d.]+", style)[:3], dtype=float) for style in styles)
            assert np.abs(ink - back).min() > 150
            assert (back.mean() > 128) == (scheme == "light")
            self.until(lambda: not self.faint_texts(), f"contrast of {CONTRAST}, {scheme}, {width}: {self.faint_texts()}")
            if self.pictures is not None:
                self.evaluate("window.zenocap?.scene?.draw()")  # tests of windows leave that out
                self.page.screenshot(path=self.pictures / f"{name}-{width}-{scheme}.png")
        self.page.set_viewport_size(before)

    def faint_texts(self) -> list[str]:
        """Texts that are seen with less contrast than CONTRAST to what is behind them, by the formula of WCAG 2.

        Behind them are the backgrounds of the elements around, of a gradient the worst of its colours, and the page's own.
        Buttons that are disabled do not count.
        """
        return [str(text) for text in cast("list[object]", self.evaluate(f"({FAINT_TEXTS})({CONTRAST})"))]

    def stop_clock(self) -> None:
        """Let the page's time pass by `page.clock.run_for` only."""
        self.page.clock.install()
        self.page.clock.pause_at(time.time() + 3600)


@contextmanager
def visited(
    browser: "Browser", address: str, width: int = 1280, height: int = 800, scheme: str = "dark",
    expected: str | None = None,
) -> Iterator[Visit]:  # fmt: skip
    """Yield a visit in a browser context of its own; at the end, no error was on its console and no URL was foreign.

    expected: pattern of errors that the test provokes.
    """
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
    try:
        one = Visit(context.new_page(), address)
        yield one
    finally:
        context.close()
    problems = [text for text in one.problems if expected is None or not re.search(expected, text)]
    assert not problems, problems
    assert not one.foreign, one.foreign
