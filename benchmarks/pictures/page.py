"""Screenshots of the page for the documentation: a real demo, or a take, in a real browser.

Needs Chromium and playwright, and an idle machine: without a graphics card the browser is slow.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser, Page, ViewportSize

from benchmarks.harness.cache import ROOT
from benchmarks.harness.case import SHARED
from benchmarks.pictures.browser import await_true, served
from tests.support.browser import Visit
from tests.support.demo_rigs import written_demo
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.errors import UserError

SIZE: ViewportSize = {"width": 1440, "height": 900}
SIZES: tuple[ViewportSize, ...] = (
    {"width": 390, "height": 844}, {"width": 1100, "height": 844}, {"width": 1280, "height": 844},
    {"width": 1920, "height": 1080},
)  # fmt: skip
Scheme = Literal["dark", "light"]
SCHEMES: tuple[Scheme, ...] = ("dark", "light")
SHEET_PX = 400  # height of one picture of the sheet of all sizes
GAP_PX = 8
TRACKED_S = 20.0  # before the screenshot
CLIP, POSITION_S = "walk7", 4.0  # take that is shown, and where it is paused


def draw(folder: Path) -> None:
    """Write page-measure.png, page.png and page-live-sizes.jpg of a demo."""
    with tempfile.TemporaryDirectory() as place:
        (port,) = free_ports(1)
        rig = written_demo(Path(place), f"[animator.page]\nport = {port}\n", method="both")
        with served(["up", str(rig)], port) as (browser, address):
            page = browser.new_page(viewport=SIZE, color_scheme="dark")
            page.goto(address)
            page.click("[data-tab=setup]")
            page.wait_for_timeout(2000)
            page.click("#measure")
            page.wait_for_timeout(2500)
            page.screenshot(path=folder / "page-measure.png")
            page.click("#measure-cancel")
            page.click("[data-tab=view]")
            await_true(page, "zenocap.state.count")
            draw_all_pixels(page)
            page.wait_for_timeout(1000 * TRACKED_S)
            page.screenshot(path=folder / "page.png")
            page.close()
            sheet_of_sizes(folder / "page-live-sizes.jpg", lambda size, scheme: live(browser, address, size, scheme))


def draw_take(folder: Path) -> None:
    """Write page-take.png and page-sizes.jpg of a shared clip, paused, beside the folder that it was tracked from."""
    with tempfile.TemporaryDirectory() as place:
        clip, take = Path(place) / CLIP, Path(place) / f"{CLIP}.mcap"
        shutil.copytree(SHARED / "clips" / CLIP, clip)
        subprocess.run([sys.executable, "-P", "-m", "zenocap", "track", str(clip), "-o", str(take)], check=True)
        (port,) = free_ports(1)
        with served(["show", str(take), "--port", str(port)], port) as (browser, address):
            paused(browser, address, SIZE, "dark").screenshot(path=folder / "page-take.png")
            sheet_of_sizes(folder / "page-sizes.jpg", lambda size, scheme: paused(browser, address, size, scheme))


def draw_windows(folder: Path) -> None:
    """Write every page and its slides in windows of all sizes, dark and light, as tests open them.  Raises UserError."""
    if folder.resolve() == ROOT / "docs":
        raise UserError(f"--folder {folder}: allowed with windows: another one, for it gets many pictures")
    Visit.pictures = folder.resolve()
    if pytest.main(["-m", "", "-k", "window or board_is_guided", str(ROOT / "tests" / "system" / "browser")]):
        raise UserError("--pictures windows: a test of a page failed: see above")


def live(browser: Browser, address: str, size: ViewportSize, scheme: Scheme) -> Page:
    """A page that shows poses."""
    page = browser.new_page(viewport=size, color_scheme=scheme)
    page.goto(address)
    await_true(page, "zenocap.state.count")
    draw_all_pixels(page)
    page.wait_for_timeout(6000)
    return page


def sheet_of_sizes(path: Path, opened: Callable[[ViewportSize, Scheme], Page]) -> None:
    """Write the pages of windows of all sizes, a row dark and a row light; elsewhere than in `docs` each of them, too."""
    rows = []
    for scheme in SCHEMES:
        row = []
        for size in SIZES:
            page = opened(size, scheme)
            picture = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
            page.close()
            assert picture is not None
            if path.parent != ROOT / "docs":
                cv2.imwrite(str(path.with_name(f"{path.stem}-{size['width']}-{scheme}.png")), picture)
            width = round(size["width"] * SHEET_PX / size["height"])
            scaled = cv2.resize(picture, (width, SHEET_PX), interpolation=cv2.INTER_AREA)
            row.append(np.pad(scaled, ((GAP_PX, GAP_PX), (GAP_PX, GAP_PX), (0, 0)), constant_values=128))
        rows.append(np.concatenate(row, axis=1))
    cv2.imwrite(str(path), np.concatenate(rows), [cv2.IMWRITE_JPEG_QUALITY, 72])


def paused(browser: Browser, address: str, size: ViewportSize, scheme: Scheme) -> Page:
    """A page whose take is paused."""
    page = live(browser, address, size, scheme)
    if page.get_attribute("#pause", "aria-label") == "pause":
        page.click("#pause")
    page.wait_for_timeout(1500)  # states of the player from before the pause have come
    page.evaluate(f"zenocap.player.seek({POSITION_S})")
    await_true(page, f"Math.abs(zenocap.state.picture_s - {POSITION_S}) < 0.1")
    await_true(page, "document.querySelectorAll('.view:not(.empty)').length === zenocap.state.cameras.size")
    page.wait_for_timeout(5000)
    return page


def draw_all_pixels(page: Page) -> None:
    """Whole resolution, as with a graphics card, however long the processor draws."""
    page.evaluate("zenocap.scene.adaptResolution = () => {}; zenocap.scene.quality = 0; zenocap.scene.requestDraw();")
