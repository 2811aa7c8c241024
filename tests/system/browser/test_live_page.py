"""Live page of the cameras in a browser: pictures, advice, board, window sizes."""

import time

import numpy as np
import pytest

from tests.support.board_bursts import SimulatedSearch, simulated
from tests.support.board_views import BOARD
from tests.support.browser import visited
from tests.support.live_cameras import camera_of, paced, picture
from tests.tools.setup.page.test_live_page import served
from zenocap.tools.setup.page import board_mode
from zenocap.tools.setup.page.board_mode import BoardMode
from zenocap.tools.setup.page.camera import LiveCamera

pytestmark = pytest.mark.core
SIZE = (640, 360)


def pictures(visit, name: str) -> int:
    return int(visit.evaluate(f"zenocap.cards.get('{name}')?.pictures ?? 0"))


def two_cameras(right_level: float = 120.0) -> list[LiveCamera]:
    left, right = picture(size=SIZE), picture(level=right_level, size=SIZE)
    return [
        camera_of(lambda: paced(lambda k: left, 20.0), "left"),
        camera_of(lambda: paced(lambda k: right, 20.0), "right"),
    ]


@pytest.mark.nightly
def test_pictures_are_shown_as_the_cameras_give_them(browser) -> None:
    with served(two_cameras()) as page, visited(browser, page.address) as visit:
        visit.until(lambda: min(pictures(visit, "left"), pictures(visit, "right")) > 3, "pictures of both")
        levels = visit.page.evaluate(
            "(() => { const image = zenocap.cards.get('left').image, canvas = new OffscreenCanvas(640, 360); "
            "const pen = canvas.getContext('2d'); pen.drawImage(image, 0, 0, 640, 360); "
            "const data = pen.getImageData(0, 0, 640, 360).data; "
            "return [[4, 4], [300, 200]].map(([x, y]) => [...data.slice(4 * (640 * y + x), 4 * (640 * y + x) + 3)]); })()"
        )
        truth = [picture(size=SIZE)[y - 3 : y + 4, x - 3 : x + 4, ::-1].mean(axis=(0, 1)) for x, y in ((4, 4), (300, 200))]
        assert np.abs(np.array(levels) - truth).max() < 25


def test_a_dark_camera_has_its_advice_and_the_other_none_in_every_window(browser) -> None:
    with served(two_cameras(right_level=12.0)) as page, visited(browser, page.address) as visit:
        text = lambda name: visit.page.inner_text(f"[data-camera={name}]")  # noqa: E731
        visit.until(lambda: "Too dark: add light" in text("right"), "the advice")
        assert "Too dark" not in text("left")
        assert visit.page.get_attribute("[data-camera=left]", "data-condition") == "ok"
        visit.check_windows()


@pytest.mark.nightly
def test_a_camera_enlarges_by_click_and_by_keys(browser) -> None:
    with served(two_cameras()) as page, visited(browser, page.address) as visit:
        visit.until(lambda: pictures(visit, "right") > 1, "pictures")
        width = lambda name: visit.page.evaluate(f"zenocap.cards.get('{name}').picture.clientWidth")  # noqa: E731
        before = width("right")
        visit.page.click("[data-camera=right] .picture")
        assert width("right") > 1.5 * before
        visit.page.keyboard.press("ArrowRight")
        assert width("left") > 1.5 * before
        assert width("right") <= before
        visit.page.keyboard.press("Escape")
        assert width("left") == pytest.approx(before, rel=0.05)
        visit.page.focus("[data-camera=left] .picture")
        visit.page.keyboard.press("Enter")
        assert width("left") > 1.5 * before


@pytest.mark.nightly
def test_the_board_is_guided_to_a_calibration_with_the_keyboard(browser, monkeypatch) -> None:
    monkeypatch.setattr(board_mode, "BURST_PERIOD_S", 0.2)
    monkeypatch.setattr(LiveCamera, "period_s", 1 / 15.0, raising=False)
    image = picture(size=(1280, 720))
    cameras = [camera_of(lambda: paced(lambda k: image, 5.0), name) for name in ("cam01", "cam02")]
    search = SimulatedSearch(simulated(2, 18.0), end=5)
    for camera in cameras:  # the images have their size before the search begins
        camera.start()
    while any(camera.newest is None for camera in cameras):
        time.sleep(0.02)
    mode = BoardMode(cameras, BOARD, 0, lambda found: "calibration.toml", search=search)
    monkeypatch.setattr(LiveCamera, "start", lambda self: None)
    with served(cameras, mode=mode) as page, visited(browser, page.address) as visit:
        said = lambda: visit.page.inner_text("#sentence")  # noqa: E731
        visit.until(lambda: "both see it" in said(), "the request to connect the cameras")
        assert visit.page.is_disabled("#calibrate")
        assert "cam0" in visit.page.inner_text("#missing")
        visit.check_windows()
        search.end = 18
        visit.until(lambda: visit.page.is_enabled("#calibrate"), "the button")
        visit.until(lambda: search.second >= 18, "all views")
        visit.until(lambda: visit.page.locator(".covered").count() > 10, "the coverage map")
        visit.until(lambda: visit.page.locator("#graph .edge.enough").count() == 1, "the connection")
        visit.page.keyboard.press("Enter")
        visit.until(lambda: visit.page.is_visible("#result"), "the result")
        assert "Calibration: poor" in visit.page.inner_text("#result")  # the board was not on the floor
        assert "floor" in visit.page.inner_text("#reasons")
        visit.check_windows()
        visit.page.click("#finish")
        visit.until(lambda: mode.finished, "the end")
    mode.close()
