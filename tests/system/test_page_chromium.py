"""The page in a real browser: it loads, the actor follows the poses, buttons act, a silent viewer turns red.

Skipped where there is no Chromium, or no playwright to drive it.
"""

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.animator_stand_in import (
    StandIn,
    assignment,
    bap,
    body,
    body_message,
    command_result,
    health,
    pose_at,
    stand_in,
)
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.bus.protocol import Alive
from zenocap.common.conversion import packed_points
from zenocap.common.messages import Request
from zenocap.common.runtime.clock import ManualClock

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [pytest.mark.core, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZE = {"width": 1280, "height": 800}
PATIENCE_S = 40.0
FIELD_OF_VIEW = np.radians(38)  # of the page's camera
MARKERS = [marker.name for marker in TEN_PARTS.markers]


class Visit:
    """An open page.  requests: every URL that it requested.  problems: errors on its console."""

    def __init__(self, browser: "playwright.Browser", animator: StandIn) -> None:
        self.animator = animator
        self.page = browser.new_page(viewport=SIZE, color_scheme="dark")
        self.requests: list[str] = []
        self.problems: list[str] = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", lambda line: self.problems.append(line.text) if line.type == "error" else None)
        self.page.goto(animator.address)
        self.until(lambda: self.text("#rig").startswith("rig demo"), "the name of the rig")

    def text(self, selector: str) -> str:
        return str(self.page.inner_text(selector))

    def evaluate(self, script: str) -> object:
        return self.page.evaluate(script)

    def until(self, condition: Callable[[], bool], text: str) -> None:
        """Poll a condition; the page's policy forbids to evaluate it there."""
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < end_s, f"not within {PATIENCE_S:g} s: {text}; {self.problems}"
            self.page.wait_for_timeout(30)

    def sees(self, frame: int) -> None:
        self.until(lambda: self.evaluate("zenocap.locate('Hip')?.frame ?? -1") == frame, f"frame {frame} on the page")


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as driver:
        one = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield one
        one.close()


@pytest.fixture
def visit(browser: "playwright.Browser", tmp_path: Path) -> Iterator[Visit]:
    (tmp_path / "walk-1.mcap").write_bytes(b"not a take")
    with stand_in(tmp_path) as animator:
        animator.begin()
        one = Visit(browser, animator)
        animator.send_frame_set(0.0)
        one.sees(1)
        both = "document.querySelectorAll('.view:not(.empty)').length == 2"  # they wait for their period, then for a tick
        one.until(lambda: (animator.tick(), bool(one.evaluate(both)))[1], "both silhouettes")
        yield one
        one.page.close()
        assert one.problems == []


def expected_px(visit: Visit, point: Floats) -> Floats:
    """Position of a world point on the page, by an independent pinhole model: only the eye is taken from the page."""
    eye = visit.evaluate(
        "({at: zenocap.scene.position, to: zenocap.scene.eye.target, shift: zenocap.scene.shift, "
        "width: innerWidth, height: innerHeight})"
    )
    assert isinstance(eye, dict)
    backwards = np.subtract(eye["at"], eye["to"])
    z = backwards / np.linalg.norm(backwards)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    local = np.array([x, np.cross(z, x), z]) @ (point - eye["at"])
    focal = eye["height"] / 2 / np.tan(FIELD_OF_VIEW / 2)
    middle = np.array([(1 + eye["shift"][0]) * eye["width"] / 2, (1 - eye["shift"][1]) * eye["height"] / 2])
    return middle + focal * np.array([local[0], -local[1]]) / -local[2]


@pytest.mark.parametrize("marker", ["RWrist", "LAnkle", "Head"])
def test_joints_are_on_the_page_where_the_kinematics_put_them(visit: Visit, marker: str) -> None:
    places = []
    for k, time_s in enumerate((0.2, 0.5, 0.8)):
        pose = visit.animator.send_frame_set(time_s)
        visit.sees(2 + k)
        where = visit.evaluate(f"zenocap.locate('{marker}')")
        assert isinstance(where, dict)
        truth = joint_centres(TEN_PARTS, body(), pose)[MARKERS.index(marker)]
        np.testing.assert_allclose(where["world"], truth, atol=1e-3)
        np.testing.assert_allclose(where["page"], expected_px(visit, truth), atol=0.6)
        places.append(where["page"])
    assert np.ptp(places, axis=0).max() > 2  # it did move


def test_elbows_are_drawn_in_the_colour_of_their_side(visit: Visit) -> None:
    """The person's left is orange, the right blue."""
    pose = Pose(np.array([0.0, 0.95, 0.0]), t_pose_angles(TEN_PARTS))
    visit.animator.receive(bap(50, visit.animator.clock.now_ns(), pose))
    visit.sees(50)
    centres = dict(zip(MARKERS, joint_centres(TEN_PARTS, body(), pose), strict=True))
    for name, is_right in (("LElbow", False), ("RElbow", True)):
        red, green, blue = pixel(visit, expected_px(visit, centres[name]))
        assert (blue > red + 40) if is_right else (red > blue + 40), (name, red, green, blue)


def pixel(visit: Visit, at: Floats) -> tuple[int, int, int]:
    """Colour that the scene has drawn at a position on the page."""
    rgb = visit.evaluate(
        f"""(() => {{ const {{scene}} = zenocap, {{gl, canvas}} = scene; scene.quality = 0; scene.draw();
        const scale = canvas.width / canvas.clientWidth, out = new Uint8Array(4);
        gl.readPixels(Math.round({at[0]} * scale), Math.round(canvas.height - {at[1]} * scale), 1, 1, gl.RGBA,
          gl.UNSIGNED_BYTE, out); return [...out]; }})()"""
    )
    assert isinstance(rgb, list)
    return rgb[0], rgb[1], rgb[2]


def test_no_request_leaves_the_machine(visit: Visit) -> None:
    visit.page.click("[data-tab=takes]")
    visit.until(lambda: visit.page.locator("#takes button").count() == 1, "takes are listed")
    home = visit.animator.address.removeprefix("http://")
    assert len(visit.requests) > 10
    away = [url for url in visit.requests if not url.split("://")[1].startswith(home) and not url.startswith("data:")]
    assert away == []


def test_a_silent_viewer_turns_red_within_two_seconds_and_recovers(browser: "playwright.Browser", tmp_path: Path) -> None:
    """With a manual clock, so that a slow machine does not fail."""
    clock = ManualClock(1_700_000_000_000_000_000)
    with stand_in(tmp_path, clock) as animator:
        animator.begin()
        visit = Visit(browser, animator)

        def condition() -> object:
            return visit.evaluate("document.querySelector('.view[data-viewer=\"2\"]')?.dataset.condition")

        def frames(seconds: float, viewers: Sequence[str]) -> None:
            for _ in range(round(15 * seconds)):
                clock.advance(10**9 // 15)
                animator.send_frame_set(0.2, viewers)
                animator.tick()
            animator.send_health(viewers)

        frames(1.0, ["1", "2"])
        visit.until(lambda: condition() == "ok", "viewer 2 is well")
        frames(0.8, ["1"])
        visit.sees(animator.frame)
        assert condition() == "ok"
        frames(0.8, ["1"])  # the table is updated four times a second
        visit.until(lambda: condition() == "stale", "viewer 2 is silent")
        assert "viewer 2 is silent" in visit.text("#alert")
        border = visit.evaluate("getComputedStyle(document.querySelector('.view[data-viewer=\"2\"]')).borderColor")
        assert border == "rgb(255, 90, 104)"
        animator.receive(Alive("viewer", "2", False, clock.now_ns()))
        frames(0.4, ["1"])
        visit.until(lambda: condition() == "gone", "viewer 2 is gone")
        frames(0.5, ["1", "2"])
        visit.until(lambda: condition() == "ok", "viewer 2 is back")
        assert not visit.page.is_visible("#alert")
        visit.page.close()
        assert visit.problems == []


def test_layers_presets_and_sliders_act(visit: Visit) -> None:
    visit.animator.play(0.4)
    for layer in ("actor", "floor", "cameras", "trails", "points"):
        visit.page.uncheck(f"#layers [name={layer}]")
        assert visit.evaluate(f"zenocap.scene.layers.{layer}") is False
        visit.page.check(f"#layers [name={layer}]")
        assert visit.evaluate(f"zenocap.scene.layers.{layer}") is True
    visit.page.uncheck("#layers [name=plots]")
    assert not visit.page.is_visible("#plots")
    visit.page.click("#presets [data-name=front]")
    assert visit.evaluate("zenocap.scene.eye.yaw") == 0
    before = visit.evaluate("zenocap.scene.lines.length")
    visit.page.fill("#trail", "0")
    assert visit.text("#trail-out") == "off"
    assert int(str(visit.evaluate("zenocap.scene.lines.length"))) < int(str(before))
    visit.page.mouse.move(640, 300)
    visit.page.mouse.down()
    visit.page.mouse.move(740, 300)
    visit.page.mouse.up()
    assert visit.evaluate("zenocap.scene.eye.yaw") == pytest.approx(-0.6)


def test_the_scene_turns_and_views_enlarge_by_keys(visit: Visit) -> None:
    visit.page.focus("#scene")
    visit.page.keyboard.press("ArrowRight")
    visit.page.keyboard.press("+")
    assert visit.evaluate("zenocap.scene.eye.yaw") == pytest.approx(1.0 - 24 * 0.006)
    assert float(str(visit.evaluate("zenocap.scene.eye.distance"))) < 6
    visit.page.evaluate("document.activeElement.blur()")
    visit.page.keyboard.press("2")
    assert visit.evaluate("zenocap.scene.eye.yaw") == 0
    view = visit.page.get_by_role("button", name="view of viewer 1: enlarge")
    longer = "Math.max(...['width', 'height'].map((key) => document.querySelector('#views canvas')[key]))"
    visit.until(lambda: visit.evaluate(longer) == 320, "a small view")
    view.focus()
    visit.page.keyboard.press("Enter")
    visit.until(lambda: visit.evaluate(longer) == 640, "the large view, drawn in its size without a new silhouette")
    assert view.get_attribute("aria-expanded") == "true"
    box = view.bounding_box()
    assert box is not None
    assert box["width"] > 0.9 * SIZE["width"]
    visit.page.keyboard.press("Escape")
    assert view.get_attribute("aria-expanded") == "false"
    visit.until(lambda: visit.evaluate(longer) == 320, "the small view again")


def test_a_joint_has_its_name_and_angles_and_distances_are_measured(visit: Visit) -> None:
    pose = Pose(np.array([0.0, 0.95, 0.0]), t_pose_angles(TEN_PARTS))
    visit.animator.receive(bap(50, visit.animator.clock.now_ns(), pose))
    visit.sees(50)
    centres = dict(zip(MARKERS, joint_centres(TEN_PARTS, body(), pose), strict=True))
    place = expected_px(visit, centres["LElbow"])
    visit.page.mouse.move(*place)
    visit.until(lambda: visit.text("#joint").startswith("left elbow\nx "), "the name of the joint")
    visit.page.select_option("#joint-from", "LShoulder")
    visit.page.select_option("#joint-to", "LElbow")
    expected = 1000 * np.linalg.norm(centres["LElbow"] - centres["LShoulder"])
    assert float(visit.text("#joint-distance").removesuffix(" mm")) == pytest.approx(expected, abs=1.0)


@pytest.mark.parametrize("width", [390, 1100])
def test_nothing_is_cut_off_on_a_telephone_and_on_a_small_screen(visit: Visit, width: int) -> None:
    visit.page.set_viewport_size({"width": width, "height": 844})
    visit.page.wait_for_timeout(200)
    outside = visit.evaluate(
        """[...document.querySelectorAll('button, select, input, b, h2, #plots figure')].filter((one) => {
        const box = one.getBoundingClientRect();
        return box.width && !one.closest('#views') && (box.left < -1 || box.right > innerWidth + 1);
        }).map((one) => one.outerHTML)"""
    )
    assert outside == []
    assert visit.evaluate("document.documentElement.scrollWidth <= innerWidth") is True
    middle = visit.evaluate("zenocap.locate('Hip').page")
    assert isinstance(middle, list)
    assert visit.evaluate(f"document.elementFromPoint({middle[0]}, {middle[1]}).id") == "scene"  # the actor is not covered


def test_scene_points_are_drawn_at_their_position(visit: Visit) -> None:
    point = np.array([0.8, 1.2, 0.4])  # beside the person
    place = expected_px(visit, point)
    assert pixel(visit, place)[1] < 150
    visit.animator.receive(m.ScenePoints(frame=1, captured_ns=1, points=packed_points(point[None])))
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 1, "one point")
    red, green, _ = pixel(visit, place)
    assert green > 180
    assert green > red + 60
    visit.page.uncheck("#layers [name=points]")
    assert pixel(visit, place)[1] < 150
    visit.page.check("#layers [name=points]")
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 0, "old points are gone")


def test_scene_points_of_another_time_than_the_pose_are_removed(visit: Visit) -> None:
    """As after a jump in a paused take."""
    pose, now_ns = pose_at(0.0), visit.animator.clock.now_ns()
    points = packed_points(np.array([[0.8, 1.2, 0.4]]))
    visit.animator.receive(m.ScenePoints(frame=1, captured_ns=now_ns, points=points))
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 1, "one point")
    script = "(() => { zenocap.state.pointsMs = Infinity; return zenocap.scene.points; })()"  # not by their age
    assert visit.evaluate(script) == 1
    visit.animator.receive(bap(50, now_ns + 200_000_000, pose))
    visit.sees(50)
    assert visit.evaluate("zenocap.scene.points") == 1
    visit.animator.receive(bap(51, now_ns + 400_000_000, pose))
    visit.sees(51)
    assert visit.evaluate("zenocap.scene.points") == 0


def test_the_axes_of_the_world_are_drawn_in_their_colours(visit: Visit) -> None:
    for layer in ("actor", "floor", "cameras", "trails", "points"):
        visit.page.uncheck(f"#layers [name={layer}]")
    places = [expected_px(visit, 0.2 * axis) for axis in np.eye(3)]
    for strongest, place in enumerate(places):
        colour = pixel(visit, place)
        assert colour[strongest] > 60 + sorted(colour)[1], (strongest, colour)
    visit.page.uncheck("#layers [name=axes]")
    for place in places:
        assert np.ptp(pixel(visit, place)) < 60


def test_a_frustum_shows_the_cameras_picture_unless_it_would_hide_the_person(visit: Visit) -> None:
    magenta = cv2.imencode(".jpg", np.full((120, 160, 3), (255, 0, 255), np.uint8))[1].tobytes()
    now_ns = visit.animator.clock.now_ns()
    visit.animator.receive(*(m.Preview(frame=1, captured_ns=now_ns, viewer=viewer, jpeg=magenta) for viewer in "12"))
    visit.page.uncheck("#layers [name=trails]")

    def shown(viewer: str) -> object:
        one = f"zenocap.scene.pictures.get('{viewer}')"
        return visit.evaluate(f"{one} && {{whole: {one}.shown === {one}.whole, bare: {one}.shown === {one}.bare}}")

    visit.until(lambda: shown("2") == {"whole": True, "bare": False}, "the picture of camera 2")
    corners = np.array(visit.evaluate("zenocap.scene.pictures.get('2').corners"))
    red, green, blue = pixel(visit, expected_px(visit, 0.9 * corners[0] + 0.1 * corners[2]))
    assert min(red, blue) > green + 60
    visit.page.uncheck("#layers [name=pictures]")
    visit.until(lambda: shown("2") == {"whole": True, "bare": True}, "its silhouette only")
    visit.page.check("#layers [name=pictures]")
    visit.page.click("#presets [data-name=front]")  # camera 1 is between eye and person
    visit.until(lambda: shown("1") == {"whole": False, "bare": True}, "the silhouette of camera 1")


def test_a_notice_goes_by_itself_and_an_alert_stays(visit: Visit) -> None:
    notice = visit.page.get_by_role("status").and_(visit.page.locator("#notice"))
    assert notice.get_attribute("aria-live") == "polite"
    assert visit.text("#notice") == ""
    assert visit.evaluate("getComputedStyle(document.getElementById('notice')).display") == "block"  # for screen readers
    visit.animator.receive(Alive("viewer", "2", False, visit.animator.clock.now_ns()))
    visit.until(lambda: (visit.animator.tick(), "viewer 2" in visit.text("#alert"))[1], "the alert")
    visit.evaluate("for (const _ of '12') document.getElementById('record').click()")  # the second one is refused
    visit.until(lambda: visit.text("#notice").startswith("refused: the recording was"), "the notice")
    shown_s = time.monotonic()
    box, alert = notice.bounding_box(), visit.page.locator("#alert").bounding_box()
    assert box is not None
    assert alert is not None
    assert box["y"] >= alert["y"] + alert["height"]
    visit.until(lambda: visit.text("#notice") == "", "no notice any more")
    assert time.monotonic() - shown_s > 4
    assert notice.count() == 1
    visit.animator.tick()
    assert "viewer 2" in visit.text("#alert")


def test_measure_body_now_counts_down_sends_the_request_and_shows_the_result(visit: Visit) -> None:
    visit.page.click("[data-tab=setup]")
    visit.page.click("#measure")
    assert visit.page.is_visible("#measure-dialog svg")
    assert visit.text("#countdown") in "54"
    requests: list[Request] = []
    visit.until(lambda: bool(requests.extend(visit.animator.bridge.requests()) or requests), "the request")
    assert [request.what for request in requests] == ["measure"]
    now_ns = visit.animator.clock.now_ns()
    visit.animator.receive(assignment(90, now_ns, pose_at(0.0), tracking=False))
    visit.until(lambda: visit.text("#measure-title") == "Hold still", "it asks to hold still")
    visit.animator.receive(body_message(now_ns))
    visit.until(lambda: visit.text("#measure-title") == "Measured", "it is measured")


def test_commands_turn_the_slides_and_the_latency_is_shown(visit: Visit) -> None:
    number = 0

    def perform(target: str, posture: str = "raise-right-arm", outcome: str = "done") -> None:
        nonlocal number
        number += 1
        visit.animator.receive(command_result(number, visit.animator.clock.now_ns(), target, posture, outcome))

    perform("demo/slides/next")  # the show is not open
    visit.page.click("#slides-open")
    assert visit.text("#slide-number") == "1 / 6"
    assert "raise right arm" in visit.text("#gestures [data-verb=next]")  # from the demo rig
    perform("demo/slides/next")
    visit.until(lambda: visit.text("#slide-number") == "2 / 6", "the next slide")
    visit.until(lambda: visit.text("#slide-latency") != "–", "the latency")
    assert visit.text("#slide-posture") == "raise right arm"
    latency_ms, since_end_ms = int(visit.text("#slide-latency")), int(visit.text("#slide-since-end"))
    assert 20 <= latency_ms < 1000 * PATIENCE_S
    assert since_end_ms - latency_ms in (299, 300, 301)
    for target, outcome in (("demo/lights/next", "done"), ("demo/slides/next", "failed"), ("demo/slides", "done")):
        perform(target, outcome=outcome)
    perform("any/other/slides/next")
    visit.until(lambda: visit.text("#slide-number") == "3 / 6", "commands that do not concern the slides are ignored")
    perform("demo/slides/previous", "raise-left-arm")
    visit.until(lambda: visit.text("#slide-number") == "2 / 6", "the previous slide")
    visit.page.keyboard.press("ArrowRight")
    assert visit.text("#slide-number") == "3 / 6"
    perform("demo/slides/first", "raise-both-arms")
    visit.until(lambda: visit.text("#slide-number") == "1 / 6", "the first slide")
    visit.until(lambda: visit.evaluate("zenocap.slides.latencies.length") == 4, "every change by a command is measured")
    visit.page.keyboard.press("Escape")
    assert not visit.page.is_visible("#slides")
    assert visit.evaluate("zenocap.scene.eye.yaw") == 1.0


def test_a_page_that_opens_does_not_perform_earlier_commands(browser: "playwright.Browser", tmp_path: Path) -> None:
    with stand_in(tmp_path) as animator:
        animator.begin()
        animator.receive(command_result(1, animator.clock.now_ns(), "demo/slides/next"))
        first = Visit(browser, animator)
        animator.tick()  # the service loop wakes up when the first page opens
        second = Visit(browser, animator)
        for visit in (first, second):
            visit.evaluate("location.hash = 'slides'")
            visit.until(lambda visit=visit: visit.page.is_visible("#slides"), "the slide show")
            visit.until(lambda visit=visit: visit.evaluate("zenocap.slides.seen?.size") == 1, "the earlier command")
            assert visit.text("#slide-number") == "1 / 6"
        animator.receive(command_result(2, animator.clock.now_ns(), "demo/slides/next"))
        for visit in (first, second):
            visit.until(lambda visit=visit: visit.text("#slide-number") == "2 / 6", "the next slide")
            visit.page.close()
            assert visit.problems == []


@pytest.mark.parametrize("width", [390, 1100])
def test_the_slide_show_fits_the_window(visit: Visit, width: int) -> None:
    visit.page.set_viewport_size({"width": width, "height": 780})
    visit.evaluate("location.hash = 'slides'")
    visit.until(lambda: visit.page.is_visible("#slides"), "the slide show")
    outside = """[...document.querySelectorAll('#slides *')].filter((one) => {
        const box = one.getBoundingClientRect();
        return box.width && (box.left < 0 || box.right > innerWidth + 0.5 || box.bottom > innerHeight + 0.5);
    }).map((one) => one.outerHTML.slice(0, 80))"""
    for _ in range(6):
        assert visit.evaluate(outside) == []
        visit.page.keyboard.press("ArrowRight")


def test_recording_is_requested_and_shown(visit: Visit) -> None:
    visit.page.click("[data-tab=takes]")
    visit.until(lambda: (visit.animator.tick(), visit.text("#record") == "Stop recording")[1], "it is recording at first")
    visit.animator.send_health(recording=False)
    visit.until(lambda: (visit.animator.tick(), visit.text("#record") == "Record a take")[1], "nothing is recorded")
    visit.page.click("#record")
    requests: list[Request] = []
    visit.until(lambda: bool(requests.extend(visit.animator.bridge.requests()) or requests), "the request")
    visit.animator.send_health(recording=True, log=321)
    visit.until(lambda: (visit.animator.tick(), visit.text("#record") == "Stop recording")[1], "it is recording")
    assert "321 messages" in visit.text("#recording-state")

    def stopped() -> bool:  # a click less than a second after the first one is refused with a notice
        visit.page.click("#record")
        requests.extend(visit.animator.bridge.requests())
        return len(requests) == 2

    visit.until(stopped, "the second request")
    assert [request.what for request in requests] == ["record", "stop_recording"]


def test_a_file_that_is_not_a_take_is_reported_and_the_page_is_live_again(visit: Visit) -> None:
    visit.page.click("[data-tab=takes]")
    visit.page.click("#takes button")
    visit.until(lambda: visit.page.is_visible("#player-problem"), "the problem is shown")
    assert "walk-1.mcap" in visit.text("#player-problem")
    visit.until(lambda: visit.text("#feed") == "live", "live again")


def test_the_page_shows_a_lost_connection_and_reconnects(browser: "playwright.Browser", tmp_path: Path) -> None:
    with stand_in(tmp_path) as first:
        visit = Visit(browser, first)
        port = int(first.address.split(":")[2].strip("/"))
    visit.until(lambda: visit.page.is_visible("#alert"), "the alarm")
    assert "no connection" in visit.text("#alert")
    with stand_in(tmp_path, port=port) as second:
        second.begin()
        visit.until(lambda: not visit.page.is_visible("#alert"), "the connection is back")
        visit.page.close()


def test_text_from_the_network_is_never_markup(visit: Visit) -> None:
    bad = "<img src=x onerror=alert(1)><script>alert(2)</script>"

    def shown() -> bool:
        visit.animator.send_frame_set(0.2)
        visit.animator.receive(health("viewer", "1", visit.animator.clock.now_ns(), bad))
        return bad in visit.text("#services")

    visit.until(shown, "the text is shown unchanged")
    assert visit.page.locator("#services img").count() == 0


@pytest.mark.parametrize(("before", "took_ms", "after"), [(0, 200, 3), (0, 70, 1), (0, 44, 0), (1, 3, 0), (3, 30, 3)])
def test_the_resolution_follows_the_drawing_time(visit: Visit, before: int, took_ms: int, after: int) -> None:
    script = f"""(() => {{ const {{scene}} = zenocap; scene.times = []; scene.quality = {before};
        for (let k = 0; k < 4; k++) scene.adaptResolution({took_ms}); return scene.quality; }})()"""
    assert visit.evaluate(script) == after
