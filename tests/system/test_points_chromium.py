"""Points placed in pictures, in a real browser: from pictures of simulated rooms to the calibration.

Skipped where there is no Chromium, or no playwright to drive it.
"""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import cv2
import numpy as np
import pytest

from tests.support.live_cameras import at_once, camera_of
from tests.support.room_pictures import ROOM, marked_picture, room_camera
from tests.tools.live.test_live_page import served
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.tools.calibration.scene_file import read_scene
from zenocap.tools.live.points_lines import LinePoints
from zenocap.tools.live.points_mode import PointsMode
from zenocap.tools.live.points_scene import ScenePoints

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as driver:
        one = driver.chromium.launch(executable_path=CHROMIUM, args=["--headless=new", "--no-sandbox"])
        yield one
        one.close()


@contextmanager
def opened(browser, cameras, task, width=1100, scheme="dark", images=None):
    """The page of a task, and its mode.  images: of the cameras; default: marks at the points of the room."""
    images = images or [marked_picture(one) for one in cameras]
    live = [camera_of(lambda k=k: at_once(lambda _: images[k], 1), one.name) for k, one in enumerate(cameras)]
    mode = PointsMode(live, task)
    with served(live, mode=mode) as page:
        tab = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        problems = []
        tab.on("pageerror", lambda error: problems.append(str(error)))
        tab.on("console", lambda line: problems.append(line.text) if line.type == "error" else None)
        tab.goto(page.address)
        until(tab, lambda: tab.evaluate(f"zenocap.panel?.stills?.size === {len(cameras)}"), "the pictures")
        yield tab, mode
        tab.close()
        assert problems == []
    mode.close()


def until(tab, condition: Callable[[], bool], text: str) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, f"not within {PATIENCE_S:g} s: {text}: {tab.inner_text('body')[:2000]}"
        tab.wait_for_timeout(30)


def click_pixel(tab, pixel) -> None:
    """Click at a pixel of the shown picture."""
    tab.locator("#picture").scroll_into_view_if_needed()
    x, y = tab.evaluate(
        f"(() => {{ const [x, y] = zenocap.panel.stage.toScreen([{pixel[0]}, {pixel[1]}]), "
        "box = document.getElementById('picture').getBoundingClientRect(); return [box.left + x, box.top + y]; })()"
    )
    tab.mouse.click(x, y)


def add_point(tab, name, place) -> None:
    count = tab.locator("#points tbody tr").count()
    tab.click("#add")
    until(tab, lambda: tab.locator("#points tbody tr").count() == count + 1, "the row")
    row = tab.locator("#points tbody tr").nth(count)
    for k, value in enumerate(place):
        row.locator("input.place").nth(k).fill(str(value))
        row.locator("input.place").nth(k).press("Tab")
    row.locator(".pointname").dblclick()
    tab.locator(".newname").fill(name)
    tab.locator(".newname").press("Enter")
    until(tab, lambda: tab.locator(".pointname", has_text=name).count() == 1, "the name")


@pytest.mark.parametrize("known", [True, False])
def test_clicked_points_give_the_cameras_and_both_files(browser, tmp_path, known) -> None:
    cameras = [room_camera("cam01", 0.3), room_camera("cam02", -1.2)]
    lenses = {one.name: Lens.of(one) for one in cameras} if known else None
    task = ScenePoints(["cam01", "cam02"], tmp_path / "points.toml", tmp_path / "room.toml", lenses)
    with opened(browser, cameras, task) as (tab, mode):
        assert "Add " in tab.inner_text("#sentence")
        for name, place in ROOM.items():
            add_point(tab, name, place)
        for camera in cameras:
            tab.click(f"#tabs button:has-text('{camera.name}')")
            for name, place in ROOM.items():
                tab.click(f".pointname:has-text('{name}')")
                click_pixel(tab, camera.project(np.array([place]))[0])
        until(tab, lambda: "good" in tab.inner_text("#outcome"), "the verdict")
        until(tab, lambda: "one pixel matters" in tab.inner_text("#effect"), "the effect of a pixel")
        tab.click("#save")
        until(tab, lambda: "written:" in tab.inner_text("#outcome"), "the files")
        tab.click("#finish")
        until(tab, lambda: mode.finished, "the end")
    found = read_calibration(tmp_path / "room.toml")
    for camera in cameras:  # clicks land on css pixels, half of a pixel of the picture away at most
        assert np.linalg.norm(found[camera.name].centre - camera.centre) < (0.03 if known else 0.15)
        turn = cv2.Rodrigues(found[camera.name].rotation @ camera.rotation.T)[0]
        assert np.degrees(np.linalg.norm(turn)) < 0.5
    scene = read_scene(tmp_path / "points.toml")
    assert scene.points == ROOM
    assert set(scene.picked["cam02"]) == set(ROOM)


def test_keys_drag_wheel_and_a_point_that_contradicts(browser, tmp_path) -> None:
    camera = room_camera("cam01", 0.3)
    task = ScenePoints(["cam01"], tmp_path / "points.toml", tmp_path / "room.toml", {"cam01": Lens.of(camera)})
    with opened(browser, [camera], task) as (tab, mode):
        for name, place in ROOM.items():
            add_point(tab, name, place)
        pick = lambda: mode._placed.picks["cam01"].get("door")  # noqa: E731
        tab.click(".pointname:has-text('door')")
        tab.focus("#picture")
        tab.keyboard.press("Enter")
        until(tab, lambda: pick() is not None, "the place in the middle")
        first = pick()
        tab.keyboard.press("ArrowRight")
        tab.keyboard.press("Shift+ArrowDown")
        tab.keyboard.press("Alt+ArrowLeft")
        until(tab, lambda: np.allclose(pick(), [first[0] + 0.9, first[1] + 10.0]), "the moves by keys")
        tab.keyboard.press("+")
        assert tab.evaluate("zenocap.panel.stage.view.zoom") == pytest.approx(1.5)
        box = tab.locator("#picture").bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        tab.mouse.move(*middle)
        tab.mouse.down()
        tab.mouse.move(middle[0] + 30, middle[1], steps=4)
        tab.mouse.up()
        until(tab, lambda: pick()[0] > first[0] + 5, "the drag")
        tab.mouse.wheel(0, -300)
        until(tab, lambda: tab.evaluate("zenocap.panel.stage.view.zoom") > 2, "the wheel")
        tab.click("#whole")
        for name, place in ROOM.items():
            tab.click(f".pointname:has-text('{name}')")
            pixel = camera.project(np.array([place]))[0] + (30.0 if name == "shelf" else 0.0)
            until(tab, lambda name=name: f"{name} in" in tab.inner_text("#chosen"), "the choice")
            tab.focus("#picture")
            tab.keyboard.press("Enter")  # places it, so that both fields have a number
            until(tab, lambda name=name: name in mode._placed.picks["cam01"], "the place")
            for field, value in (("#column", pixel[0]), ("#row", pixel[1])):
                tab.fill(field, f"{value:.2f}")
                tab.press(field, "Tab")
        until(tab, lambda: "poor" in tab.inner_text("#outcome"), "the verdict")
        assert "shelf is " in tab.inner_text("#reasons")
        assert "shelf" in tab.locator("#points tr.suspect").inner_text()
        assert "shelf contradicts" in tab.get_attribute("#tabs button", "aria-label")
        assert "picture of cam01" in tab.get_attribute("#picture", "aria-label")


def test_the_lines_of_the_paper_with_the_verdict_at_once(browser, tmp_path) -> None:
    from tests.support.simulated_cameras import paper_cameras

    cameras = paper_cameras()
    tops = {"A": (0.0, 1.7, 0.0), "B": (0.0, 1.7, 1.0), "C": (1.0, 1.7, 0.0)}
    task = LinePoints(["cam01", "cam02"], tmp_path / "lines.toml", tmp_path / "room.toml")
    images = [marked_picture(one, tops) for one in cameras]
    with opened(browser, cameras, task, images=images) as (tab, _):
        for key, value in (("d_x", 1), ("d_z", 1), ("t", 1.7), ("distance1", 5.2), ("distance2", 5.2)):
            tab.fill(f"#field-{key}", str(value))
            tab.press(f"#field-{key}", "Tab")
        for camera in cameras:
            tab.click(f"#tabs button:has-text('{camera.name}')")
            for name, place in tops.items():
                tab.click(f".pointname:has-text('{name}')")
                click_pixel(tab, camera.project(np.array([place]))[0])
        until(tab, lambda: "unchecked" in tab.inner_text("#outcome"), "the verdict without heights")
        assert "one pixel in the" in tab.inner_text("#reports")
        for number in (1, 2):
            tab.fill(f"#field-height{number}", "1")
            tab.press(f"#field-height{number}", "Tab")
        until(tab, lambda: "Calibration: good" in tab.inner_text("#outcome"), "the verdict with heights")
        tab.click("#save")
        until(tab, lambda: "written:" in tab.inner_text("#outcome"), "the files")
    found = read_calibration(tmp_path / "room.toml")
    for camera in cameras:
        assert np.linalg.norm(found[camera.name].centre - camera.centre) < 0.02
        assert found[camera.name].matrix[0, 0] == pytest.approx(600.0, rel=0.01)


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (390, "dark"), (1100, "light"), (1920, "dark")])
def test_nothing_is_wider_than_the_window(browser, tmp_path, width, scheme) -> None:
    camera = room_camera("cam01", 0.3)
    (tmp_path / "points.toml").write_text(scene_file(camera))
    task = ScenePoints(["cam01"], tmp_path / "points.toml", tmp_path / "room.toml", {"cam01": Lens.of(camera)})
    with opened(browser, [camera], task, width, scheme) as (tab, _):
        until(tab, lambda: "good" in tab.inner_text("#outcome"), "the verdict of the points in the file")
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        assert tab.locator("#points tbody tr").count() == len(ROOM)


def scene_file(camera) -> str:
    lines = ["size = [640, 480]", "[points]", *(f"{name} = {list(place)}" for name, place in ROOM.items()), "[cam01]"]
    pixels = {name: camera.project(np.array([place]))[0].round(2).tolist() for name, place in ROOM.items()}
    return "\n".join([*lines, *(f"{name} = {pixel}" for name, pixel in pixels.items())])
