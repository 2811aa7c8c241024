"""Points placed in pictures, in a real browser: from pictures of simulated rooms to the calibration."""

from contextlib import closing, contextmanager

import cv2
import numpy as np
import pytest

from tests.support.browser import visited
from tests.support.live_cameras import at_once, camera_of
from tests.support.room_pictures import ROOM, marked_picture, room_camera
from tests.support.simulated_cameras import paper_cameras
from tests.tools.setup.page.test_live_page import served
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.tools.setup.calibration.scene_file import read_scene
from zenocap.tools.setup.page.points_lines import LinePoints
from zenocap.tools.setup.page.points_mode import PointsMode
from zenocap.tools.setup.page.points_scene import ScenePointTask

pytestmark = pytest.mark.core


@contextmanager
def opened(browser, cameras, task, images=None):
    """The page of a task, and its mode.  images: of the cameras; default: marks at the points of the room."""
    images = images or [marked_picture(one) for one in cameras]
    live = [camera_of(lambda k=k: at_once(lambda _: images[k], 1), one.name) for k, one in enumerate(cameras)]
    mode = PointsMode(live, task)
    with closing(mode), served(live, mode=mode) as page, visited(browser, page.address, 1100, 900) as visit:
        visit.until(lambda: visit.evaluate(f"zenocap.panel?.stills?.size === {len(cameras)}"), "the pictures")
        yield visit, mode


def pick(visit, mode, camera, name, point) -> None:
    """Click at the pixel of a point in the picture of a camera."""
    tab, pixel = visit.page, camera.project(np.array([point]))[0]
    tab.click(f".pointname:has-text('{name}')")
    visit.until(lambda: f"{name} in {camera.name}" in tab.inner_text("#chosen"), f"the choice of {name}")
    tab.locator("#picture").scroll_into_view_if_needed()
    x, y = tab.evaluate(
        f"(() => {{ const [x, y] = zenocap.panel.stage.toScreen([{pixel[0]}, {pixel[1]}]), "
        "box = document.getElementById('picture').getBoundingClientRect(); return [box.left + x, box.top + y]; })()"
    )
    tab.mouse.click(x, y)
    visit.until(lambda: name in mode._placed.picks.get(camera.name, {}), f"{name} in {camera.name}")


def add_point(visit, name, place) -> None:
    tab = visit.page
    count = tab.locator("#points tbody tr").count()
    tab.click("#add")
    visit.until(lambda: tab.locator("#points tbody tr").count() == count + 1, "the row")
    row = tab.locator("#points tbody tr").nth(count)
    for k, value in enumerate(place):
        row.locator("input.place").nth(k).fill(str(value))
        row.locator("input.place").nth(k).press("Tab")
    row.locator(".pointname").dblclick()
    tab.locator(".newname").fill(name)
    tab.locator(".newname").press("Enter")
    visit.until(lambda: tab.locator(".pointname", has_text=name).count() == 1, "the name")


@pytest.mark.nightly
@pytest.mark.parametrize("known", [True, False])
def test_clicked_points_give_the_cameras_and_both_files(browser, tmp_path, known) -> None:
    cameras = [room_camera("cam01", 0.3), room_camera("cam02", -1.2)]
    lenses = {one.name: Lens.of(one) for one in cameras} if known else None
    task = ScenePointTask(["cam01", "cam02"], tmp_path / "points.toml", tmp_path / "room.toml", lenses)
    with opened(browser, cameras, task) as (visit, mode):
        tab, top = visit.page, "document.getElementById('picture').getBoundingClientRect().top + scrollY"
        before = tab.evaluate(top)
        assert "Add " in tab.inner_text("#sentence")
        for name, place in ROOM.items():
            add_point(visit, name, place)
        for camera in cameras:
            tab.click(f"#tabs button:has-text('{camera.name}')")
            for name, point in ROOM.items():
                pick(visit, mode, camera, name, point)
        visit.until(lambda: "good" in tab.inner_text("#outcome"), "the verdict")
        assert tab.evaluate(top) == before  # under the pointer, whatever is written above
        visit.until(lambda: "one pixel matters" in tab.inner_text("#effect"), "the effect of a pixel")
        tab.click("#save")
        visit.until(lambda: "written:" in tab.inner_text("#outcome"), "the files")
        tab.click("#finish")
        visit.until(lambda: mode.finished, "the end")
    found = read_calibration(tmp_path / "room.toml")
    for camera in cameras:  # clicks land on css pixels, half of a pixel of the picture away at most
        assert np.linalg.norm(found[camera.name].centre - camera.centre) < (0.03 if known else 0.15)
        turn = cv2.Rodrigues(found[camera.name].rotation @ camera.rotation.T)[0]
        assert np.degrees(np.linalg.norm(turn)) < 0.5
    scene = read_scene(tmp_path / "points.toml")
    assert scene.points == ROOM
    assert set(scene.picked["cam02"]) == set(ROOM)


@pytest.mark.nightly
def test_keys_drag_wheel_and_a_point_that_contradicts(browser, tmp_path) -> None:
    camera = room_camera("cam01", 0.3)
    task = ScenePointTask(["cam01"], tmp_path / "points.toml", tmp_path / "room.toml", {"cam01": Lens.of(camera)})
    with opened(browser, [camera], task) as (visit, mode):
        tab = visit.page
        for name, place in ROOM.items():
            add_point(visit, name, place)
        pick = lambda: mode._placed.picks["cam01"].get("door")  # noqa: E731
        tab.click(".pointname:has-text('door')")
        tab.focus("#picture")
        tab.keyboard.press("Enter")
        visit.until(lambda: pick() is not None, "the place in the middle")
        first = pick()
        tab.keyboard.press("ArrowRight")
        tab.keyboard.press("Shift+ArrowDown")
        tab.keyboard.press("Alt+ArrowLeft")
        visit.until(lambda: np.allclose(pick(), [first[0] + 0.9, first[1] + 10.0]), "the moves by keys")
        tab.keyboard.press("+")
        assert tab.evaluate("zenocap.panel.stage.view.zoom") == pytest.approx(1.5)
        box = tab.locator("#picture").bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        tab.mouse.move(*middle)
        tab.mouse.down()
        tab.mouse.move(middle[0] + 30, middle[1], steps=4)
        tab.mouse.up()
        visit.until(lambda: pick()[0] > first[0] + 5, "the drag")
        tab.mouse.wheel(0, -300)
        visit.until(lambda: tab.evaluate("zenocap.panel.stage.view.zoom") > 2, "the wheel")
        tab.click("#whole")
        for name, place in ROOM.items():
            tab.click(f".pointname:has-text('{name}')")
            pixel = camera.project(np.array([place]))[0] + (30.0 if name == "shelf" else 0.0)
            visit.until(lambda name=name: f"{name} in" in tab.inner_text("#chosen"), "the choice")
            tab.focus("#picture")
            tab.keyboard.press("Enter")  # places it, so that both fields have a number
            visit.until(lambda name=name: name in mode._placed.picks["cam01"], "the place")
            for field, value in (("#column", pixel[0]), ("#row", pixel[1])):
                tab.fill(field, f"{value:.2f}")
                tab.press(field, "Tab")
        visit.until(lambda: "poor" in tab.inner_text("#outcome"), "the verdict")
        assert "shelf is " in tab.inner_text("#reasons")
        assert "shelf" in tab.locator("#points tr.suspect").inner_text()
        assert "shelf contradicts" in tab.get_attribute("#tabs button", "aria-label")
        assert "picture of cam01" in tab.get_attribute("#picture", "aria-label")


@pytest.mark.nightly
def test_the_lines_of_the_paper_with_the_verdict_at_once(browser, tmp_path) -> None:
    cameras = paper_cameras()
    tops = {"A": (0.0, 1.7, 0.0), "B": (0.0, 1.7, 1.0), "C": (1.0, 1.7, 0.0)}
    task = LinePoints(["cam01", "cam02"], tmp_path / "lines.toml", tmp_path / "room.toml")
    images = [marked_picture(one, tops) for one in cameras]
    with opened(browser, cameras, task, images=images) as (visit, mode):
        tab = visit.page
        for key, value in (("d_x", 1), ("d_z", 1), ("t", 1.7), ("distance1", 5.2), ("distance2", 5.2)):
            tab.fill(f"#field-{key}", str(value))
            tab.press(f"#field-{key}", "Tab")
        for camera in cameras:
            tab.click(f"#tabs button:has-text('{camera.name}')")
            for name, point in tops.items():
                pick(visit, mode, camera, name, point)
        visit.until(lambda: "unchecked" in tab.inner_text("#outcome"), "the verdict without heights")
        assert "one pixel in the" in tab.inner_text("#reports")
        for number in (1, 2):
            tab.fill(f"#field-height{number}", "1")
            tab.press(f"#field-height{number}", "Tab")
        visit.until(lambda: "Calibration: good" in tab.inner_text("#outcome"), "the verdict with heights")
        tab.click("#save")
        visit.until(lambda: "written:" in tab.inner_text("#outcome"), "the files")
    found = read_calibration(tmp_path / "room.toml")
    for camera in cameras:
        assert np.linalg.norm(found[camera.name].centre - camera.centre) < 0.02
        assert found[camera.name].matrix[0, 0] == pytest.approx(600.0, rel=0.01)


def test_points_of_a_file_are_judged_and_the_page_suits_every_window(browser, tmp_path) -> None:
    camera = room_camera("cam01", 0.3)
    (tmp_path / "points.toml").write_text(scene_file(camera))
    task = ScenePointTask(["cam01"], tmp_path / "points.toml", tmp_path / "room.toml", {"cam01": Lens.of(camera)})
    with opened(browser, [camera], task) as (visit, _):
        visit.until(lambda: "good" in visit.text("#outcome"), "the verdict of the points in the file")
        assert visit.page.locator("#points tbody tr").count() == len(ROOM)
        visit.check_windows()


def scene_file(camera) -> str:
    lines = ["size = [640, 480]", "[points]", *(f"{name} = {list(place)}" for name, place in ROOM.items()), "[cam01]"]
    pixels = {name: camera.project(np.array([place]))[0].round(2).tolist() for name, place in ROOM.items()}
    return "\n".join([*lines, *(f"{name} = {pixel}" for name, pixel in pixels.items())])
