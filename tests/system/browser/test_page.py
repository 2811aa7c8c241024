"""Page in a browser: it loads, the actor follows, buttons act, silent viewers turn red."""

import re
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import product
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
from tests.support.browser import PATIENCE_S, SCHEMES, Visit, visited
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.bus.protocol import Alive
from zenocap.common.conversion import angles_by_name, body_of, packed_points
from zenocap.common.messages import Request
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.tracker.body.average_body import body_of_height
from zenocap.services.viewer.shell import camera_info

pytestmark = pytest.mark.core
FIELD_OF_VIEW = np.radians(38)  # of the page's camera
T_POSE = Pose(np.array([0.0, 0.95, 0.0]), t_pose_angles(TEN_PARTS))


@pytest.fixture
def animator(tmp_path: Path) -> Iterator[StandIn]:
    """With a manual clock, so that a slow machine changes nothing; its list of takes has one file, which is no take."""
    (tmp_path / "walk-1.mcap").write_bytes(b"not a take")
    with stand_in(tmp_path, ManualClock(time.time_ns())) as one:
        one.begin()
        yield one


@contextmanager
def opened(
    browser: object, animator: StandIn, expected: str | None = None, width: int = 1280, scheme: str = "dark"
) -> Iterator[Visit]:
    with visited(browser, animator.address, width, scheme=scheme, expected=expected) as one:
        one.until(lambda: one.text("#rig").startswith("rig demo"), "the name of the rig")
        yield one


@pytest.fixture
def visit(browser: object, animator: StandIn) -> Iterator[Visit]:
    """A page that shows a pose and both silhouettes."""
    with opened(browser, animator) as one:
        animator.send_frame_set(0.0)
        sees(one, 1)
        both = "document.querySelectorAll('.view:not(.empty)').length == 2"  # they wait for their period, then for a tick
        one.until(lambda: (tick(animator), one.evaluate(both))[1], "both silhouettes")
        yield one


def sees(visit: Visit, frame: int) -> None:
    visit.until(lambda: visit.evaluate("zenocap.locate('Hip')?.frame ?? -1") == frame, f"frame {frame} on the page")


def tick(animator: StandIn) -> None:
    animator.clock.advance(30_000_000)
    animator.tick()


def centres_of(pose: Pose) -> dict[str, Floats]:
    """Joint centres of the person by marker."""
    markers = (marker.name for marker in TEN_PARTS.markers)
    return dict(zip(markers, joint_centres(TEN_PARTS, body(), pose), strict=True))


def expected_px(visit: Visit, point: Floats) -> Floats:
    """Position of a world point on the page, by an independent pinhole model: only the eye is taken from the page."""
    eye = visit.evaluate(
        "({at: zenocap.scene.position, to: zenocap.scene.eye.target, shift: zenocap.scene.shift, "
        "width: innerWidth, height: innerHeight})"
    )
    backwards = np.subtract(eye["at"], eye["to"])
    z = backwards / np.linalg.norm(backwards)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    local = np.array([x, np.cross(z, x), z]) @ (point - eye["at"])
    focal = eye["height"] / 2 / np.tan(FIELD_OF_VIEW / 2)
    middle = np.array([(1 + eye["shift"][0]) * eye["width"] / 2, (1 - eye["shift"][1]) * eye["height"] / 2])
    return middle + focal * np.array([local[0], -local[1]]) / -local[2]


def test_joints_are_on_the_page_where_the_kinematics_put_them(visit: Visit, animator: StandIn) -> None:
    places = []
    for k, time_s in enumerate((0.2, 0.5, 0.8)):
        centres = centres_of(animator.send_frame_set(time_s))
        sees(visit, 2 + k)
        for marker in ("RWrist", "LAnkle", "Head"):
            where = visit.evaluate(f"zenocap.locate('{marker}')")
            np.testing.assert_allclose(where["world"], centres[marker], atol=1e-3)
            np.testing.assert_allclose(where["page"], expected_px(visit, centres[marker]), atol=0.6)
            places.append(where["page"])
    assert (np.ptp(np.reshape(places, (3, 3, 2)), axis=0).max(axis=1) > 2).all()  # each did move


def test_elbows_are_drawn_in_the_colour_of_their_side(visit: Visit, animator: StandIn) -> None:
    """The person's left is orange, the right blue."""
    animator.receive(bap(50, animator.clock.now_ns(), T_POSE))
    sees(visit, 50)
    centres = centres_of(T_POSE)
    for name, is_right in (("LElbow", False), ("RElbow", True)):
        red, green, blue = pixel(visit, expected_px(visit, centres[name]))
        assert (blue > red + 40) if is_right else (red > blue + 40), (name, red, green, blue)


def test_a_visitor_switches_between_both_methods_of_a_rig_and_sees_the_exchange(browser: object, tmp_path: Path) -> None:
    """The tracker's pose is shown first, the other method's as a ghost; each view has role and scaling factor."""
    with (
        stand_in(tmp_path, ManualClock(time.time_ns()), rig=demo_rig("both")) as animator,
        opened(browser, animator) as visit,
    ):
        animator.begin()
        began_ns = animator.clock.now_ns() - 5 * 10**9  # now the person of the demo is there, in the T-pose
        animator.receive(*(camera_info(viewer, began_ns) for viewer in animator.rig.viewers))
        for k in range(2):
            pose = animator.send_frame_set(0.2 * k)
            animator.receive(*tracked(k, animator.clock.now_ns(), pose))
            tick(animator)
        visit.until(lambda: visit.evaluate("zenocap.state.source") == "tracker", "the tracker's pose")
        names = visit.evaluate("[...document.querySelectorAll('#sources button')].map((one) => one.textContent)")
        assert names == ["tracker", "two-view"]
        visit.until(lambda: visit.text(".view[data-viewer='1'] .scale") == "×1.00", "the scaling factor of viewer 1")
        assert [visit.text(f".view[data-viewer='{id}'] .role") for id in "12"] == ["facade", "flank"]
        errors = re.compile(r"Distance from the simulated person: tracker (\d+) mm · two-view (\d+) mm")
        visit.until(lambda: (tick(animator), errors.fullmatch(visit.text("#distances")))[1], "both distances")
        counts = "[zenocap.scene.capsules.length, zenocap.scene.ghost.length]"
        visit.until(lambda: visit.evaluate(counts) == [14, 11], "the tracker's capsules, and the ghost's")
        visit.page.click("#sources [data-name=two-view]")
        visit.until(lambda: visit.evaluate(counts) == [11, 14], "both exchanged")
        animator.receive(*tracked(9, animator.clock.now_ns(), pose))
        assert visit.evaluate("zenocap.state.source") == "two-view"  # the visitor's choice stays
        visit.page.click("#layers [name=others]")
        visit.until(lambda: visit.evaluate(counts) == [11, 0], "no ghost")
        assert visit.problems == []


def tracked(frame: int, now_ns: int, pose: Pose) -> tuple[m.TrackerBdp, m.TrackerPose]:
    """Body and pose of the tracker, upright at the place of a pose."""
    x, y, z = pose.position.tolist()
    angles = angles_by_name(FOURTEEN_PARTS, FOURTEEN_PARTS.neutral)
    return (
        m.TrackerBdp(frame=frame, captured_ns=now_ns, body=body_of(FOURTEEN_PARTS, body_of_height(1.75))),
        built(m.TrackerPose, frame=frame, captured_ns=now_ns, position=(x, y, z), angles=angles, lost=False),
    )


def pixel(visit: Visit, at: Floats) -> tuple[int, int, int]:
    """Colour that the scene has drawn at a position on the page."""
    rgb = visit.evaluate(
        f"""(() => {{ const {{scene}} = zenocap, {{gl, canvas}} = scene; scene.quality = 0; scene.draw();
        const scale = canvas.width / canvas.clientWidth, out = new Uint8Array(4);
        gl.readPixels(Math.round({at[0]} * scale), Math.round(canvas.height - {at[1]} * scale), 1, 1, gl.RGBA,
          gl.UNSIGNED_BYTE, out); return [...out]; }})()"""
    )
    return tuple(rgb)[:3]


def test_no_request_leaves_the_machine(visit: Visit) -> None:
    visit.page.click("[data-tab=takes]")
    visit.until(lambda: visit.page.locator("#takes button").count() == 1, "takes are listed")
    assert len(visit.requests) > 10
    assert visit.foreign == []


def test_a_silent_viewer_turns_red_within_two_seconds_and_recovers(browser: object, animator: StandIn) -> None:
    def frames(seconds: float, viewers: Sequence[str]) -> None:
        for _ in range(round(15 * seconds)):
            animator.clock.advance(10**9 // 15)
            animator.send_frame_set(0.2, viewers)
            animator.tick()
        animator.send_health(viewers)

    with opened(browser, animator) as visit:

        def condition() -> object:
            return visit.evaluate("document.querySelector('.view[data-viewer=\"2\"]')?.dataset.condition")

        frames(1.0, ["1", "2"])
        visit.until(lambda: condition() == "ok", "viewer 2 is well")
        frames(0.8, ["1"])
        sees(visit, animator.frame)
        assert condition() == "ok"
        frames(0.8, ["1"])  # the table is updated four times a second
        visit.until(lambda: condition() == "stale", "viewer 2 is silent")
        assert "viewer 2 is silent" in visit.text("#alert")
        border = visit.evaluate("getComputedStyle(document.querySelector('.view[data-viewer=\"2\"]')).borderColor")
        assert border == "rgb(255, 90, 104)"
        animator.receive(Alive("viewer", "2", False, animator.clock.now_ns()))
        frames(0.4, ["1"])
        visit.until(lambda: condition() == "gone", "viewer 2 is gone")
        frames(0.5, ["1", "2"])
        visit.until(lambda: condition() == "ok", "viewer 2 is back")
        assert not visit.page.is_visible("#alert")


def test_layers_presets_and_sliders_act(visit: Visit, animator: StandIn) -> None:
    for time_s in (0.1, 0.2, 0.3):
        animator.clock.advance(100_000_000)
        animator.send_frame_set(time_s)
        sees(visit, animator.frame)
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
    assert view.bounding_box()["width"] > 0.9 * 1280
    visit.page.keyboard.press("Escape")
    assert view.get_attribute("aria-expanded") == "false"
    visit.until(lambda: visit.evaluate(longer) == 320, "the small view again")


def test_a_joint_has_its_name_and_angles_and_distances_are_measured(visit: Visit, animator: StandIn) -> None:
    animator.receive(bap(50, animator.clock.now_ns(), T_POSE))
    sees(visit, 50)
    centres = centres_of(T_POSE)
    place = expected_px(visit, centres["LElbow"])
    visit.page.mouse.move(*place)
    visit.until(lambda: visit.text("#joint").startswith("left elbow\nx "), "the name of the joint")
    visit.page.select_option("#joint-from", "LShoulder")
    visit.page.select_option("#joint-to", "LElbow")
    expected = 1000 * np.linalg.norm(centres["LElbow"] - centres["LShoulder"])
    assert float(visit.text("#joint-distance").removesuffix(" mm")) == pytest.approx(expected, abs=1.0)


def test_nothing_is_cut_off_or_covered_on_a_telephone_and_on_a_small_screen(visit: Visit, animator: StandIn) -> None:
    outside = """[...document.querySelectorAll('button, select, input, b, h2, #plots figure')].filter((one) => {
        const box = one.getBoundingClientRect();
        return box.width && !one.closest('#views') && (box.left < -1 || box.right > innerWidth + 1);
    }).map((one) => one.outerHTML)"""
    animator.receive(built(m.Posture, label="raise-right-arm"), Alive("viewer", "2", False, animator.clock.now_ns()))
    visit.until(lambda: (tick(animator), "viewer 2" in visit.text("#alert"))[1], "an alert")
    uncut = "(({scrollWidth, clientWidth}) => scrollWidth <= clientWidth)(document.getElementById('posture'))"
    under_actor = "(([x, y]) => document.elementFromPoint(x, y)?.id)(zenocap.locate('Hip').page)"
    for width in (1100, 390):
        visit.page.set_viewport_size({"width": width, "height": 844})
        visit.until(lambda width=width: visit.evaluate("innerWidth") == width, "the new size")
        assert visit.evaluate(outside) == []
        assert visit.evaluate(uncut) is True
        alert, brand = (visit.page.locator(one).bounding_box() for one in ("#alert", "#brand"))
        assert alert["x"] >= brand["x"] + brand["width"] or alert["y"] >= brand["y"] + brand["height"]
        assert visit.evaluate("document.documentElement.scrollWidth <= innerWidth") is True
        visit.until(lambda: visit.evaluate(under_actor) == "scene", "the actor is not covered")
    visit.evaluate("scrollTo(0, document.body.scrollHeight), document.querySelector('[data-tab]').focus()")
    assert visit.evaluate("document.activeElement.getBoundingClientRect().top > 0.51 * innerHeight")  # below the scene


def test_scene_points_are_drawn_at_their_position(visit: Visit, animator: StandIn) -> None:
    visit.stop_clock()
    point = np.array([0.8, 1.2, 0.4])  # beside the person
    place = expected_px(visit, point)
    assert pixel(visit, place)[1] < 150
    animator.receive(m.ScenePoints(frame=1, captured_ns=1, points=packed_points(point[None])))
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 1, "one point")
    red, green, _ = pixel(visit, place)
    assert green > 180
    assert green > red + 60
    visit.page.uncheck("#layers [name=points]")
    assert pixel(visit, place)[1] < 150
    visit.page.check("#layers [name=points]")
    visit.page.clock.run_for(1600)
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 0, "old points are gone")


def test_scene_points_of_another_time_than_the_pose_are_removed(visit: Visit, animator: StandIn) -> None:
    """As after a jump in a paused take."""
    visit.stop_clock()  # so that they are not removed by their age
    pose, now_ns = pose_at(0.0), animator.clock.now_ns()
    points = packed_points(np.array([[0.8, 1.2, 0.4]]))
    animator.receive(m.ScenePoints(frame=1, captured_ns=now_ns, points=points))
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 1, "one point")
    animator.receive(bap(50, now_ns + 200_000_000, pose))
    sees(visit, 50)
    assert visit.evaluate("zenocap.scene.points") == 1
    animator.receive(bap(51, now_ns + 400_000_000, pose))
    sees(visit, 51)
    assert visit.evaluate("zenocap.scene.points") == 0


def test_scene_points_go_with_the_body_until_the_next_ones_come(visit: Visit, animator: StandIn) -> None:
    visit.stop_clock()
    pose, now_ns = pose_at(0.0), animator.clock.now_ns()
    animator.receive(bap(49, now_ns, pose))
    sees(visit, 49)
    points = packed_points(np.array([[0.8, 1.2, 0.4]]))
    animator.receive(m.ScenePoints(frame=49, captured_ns=now_ns, points=points))
    visit.until(lambda: visit.evaluate("zenocap.scene.points") == 1, "one point")
    moved = Pose(pose.position + np.array([-0.3, 0.0, 0.1]), pose.angles)
    animator.receive(bap(50, now_ns + 50_000_000, moved))
    sees(visit, 50)
    place = expected_px(visit, np.array([0.5, 1.2, 0.5]))  # the eye follows the body
    red, green, _ = pixel(visit, place)
    assert green > red + 60
    visit.page.uncheck("#layers [name=points]")
    red, green, _ = pixel(visit, place)
    assert green < red + 60


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


def test_a_frustum_shows_the_cameras_picture_unless_it_would_hide_the_person(visit: Visit, animator: StandIn) -> None:
    magenta = cv2.imencode(".jpg", np.full((120, 160, 3), (255, 0, 255), np.uint8))[1].tobytes()
    now_ns = animator.clock.now_ns()
    animator.receive(*(m.Preview(frame=1, captured_ns=now_ns, viewer=viewer, jpeg=magenta) for viewer in "12"))
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


# Puts the middle of the first line of a frustum under the inner edge of a panel, with thick lines, or draws no cameras;
# returns the boxes of the panel, without its border and corners, and of all panels.
FRUSTUM_UNDER = """([panel, cameras]) => {
  const {scene} = zenocap, one = document.querySelector(panel).getBoundingClientRect();
  const {from, to} = scene.lines.find(({layer}) => layer === 'cameras');
  const [x, y] = scene.toPage(from.map((value, k) => (value + to[k]) / 2));
  const edge = one.left > innerWidth / 2 ? one.left : one.right, middle = one.top + one.height / 2;
  const [right, up] = scene.shift;
  scene.shift = [right + 2 * (edge - x) / innerWidth, up - 2 * (middle - y) / innerHeight];
  const thick = { width: 6, colour: [1, 0.3, 0.3, 1] };
  scene.lines = scene.lines.map((line) => (line.layer === 'cameras' ? {...line, ...thick} : line));
  scene.layers.cameras = cameras;
  scene.draw();
  const all = [...document.querySelectorAll('.glass')].map((each) => each.getBoundingClientRect());
  const rounded = 14, rows = all.map(({left, top, right, bottom}) => [left, top, right, bottom]);
  return [[one.left + rounded, one.top + rounded, one.right - rounded, one.bottom - rounded], ...rows];
}"""


def shining(visit: Visit, panel: str) -> tuple[int, int]:
    """Largest change of a channel by the lines of the cameras: within a panel, and beside all of them."""
    pictures = []
    for cameras in (True, False):
        own, *every = np.round(visit.page.evaluate(FRUSTUM_UNDER, [panel, cameras])).astype(int)
        pictures.append(cv2.imdecode(np.frombuffer(visit.page.screenshot(), np.uint8), cv2.IMREAD_COLOR).astype(int))
    apart = np.abs(pictures[0] - pictures[1]).max(axis=2)
    within = int(apart[own[1] : own[3], own[0] : own[2]].max())
    for left, top, right, bottom in every:
        apart[max(0, top - 1) : bottom + 1, max(0, left - 1) : right + 1] = 0
    return within, int(apart.max())


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_lines_of_the_cameras_do_not_shine_through_the_panels(browser: object, animator: StandIn, scheme: str) -> None:
    with opened(browser, animator, scheme=scheme) as visit:
        animator.send_frame_set(0.0)
        sees(visit, 1)
        for panel in ("#right", "#brand"):
            found: list[tuple[int, int]] = []

            def seen(panel: str = panel, found: list[tuple[int, int]] = found) -> bool:
                found.append(shining(visit, panel))
                return found[-1][1] > 60

            visit.until(seen, f"a frustum beside {panel}")
            assert found[-1][0] < 10, (panel, found)


def test_a_notice_goes_by_itself_and_an_alert_stays(visit: Visit, animator: StandIn) -> None:
    notice = visit.page.get_by_role("status").and_(visit.page.locator("#notice"))
    assert notice.get_attribute("aria-live") == "polite"
    assert visit.text("#notice") == ""
    assert visit.evaluate("getComputedStyle(document.getElementById('notice')).display") == "block"  # for screen readers
    animator.receive(Alive("viewer", "2", False, animator.clock.now_ns()))
    visit.until(lambda: (tick(animator), "viewer 2" in visit.text("#alert"))[1], "the alert")
    visit.stop_clock()
    visit.evaluate("for (const _ of '12') document.getElementById('record').click()")  # the second one is refused
    visit.until(lambda: visit.text("#notice").startswith("refused: the recording was"), "the notice")
    box, alert = notice.bounding_box(), visit.page.locator("#alert").bounding_box()
    assert box["y"] >= alert["y"] + alert["height"]
    visit.page.clock.run_for(7900)
    assert visit.text("#notice") != ""
    visit.page.clock.run_for(200)
    assert visit.text("#notice") == ""
    assert notice.count() == 1
    tick(animator)
    assert "viewer 2" in visit.text("#alert")


def test_measure_body_now_counts_down_sends_the_request_and_shows_the_result(visit: Visit, animator: StandIn) -> None:
    visit.page.click("[data-tab=setup]")
    visit.stop_clock()
    visit.page.click("#measure")
    assert visit.page.is_visible("#measure-dialog svg")
    assert "facing any way; with the method two-view, the first camera." in visit.text("#measure-text")
    for second in "54321":
        assert visit.text("#countdown") == second
        visit.page.clock.run_for(1000)
    requests: list[Request] = []
    visit.until(lambda: bool(requests.extend(animator.bridge.requests()) or requests), "the request")
    assert [request.what for request in requests] == ["measure"]
    now_ns = animator.clock.now_ns()
    animator.receive(assignment(90, now_ns, pose_at(0.0), tracking=False))
    visit.until(lambda: visit.text("#measure-title") == "Hold still", "it asks to hold still")
    animator.receive(body_message(now_ns))
    visit.until(lambda: visit.text("#measure-title") == "Measured", "it is measured")


def test_commands_turn_the_slides_and_the_latency_is_shown(visit: Visit, animator: StandIn) -> None:
    number = 0

    def perform(target: str, posture: str = "raise-right-arm", outcome: str = "done") -> None:
        nonlocal number
        number += 1
        animator.receive(command_result(number, time.time_ns(), target, posture, outcome))

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


def test_a_page_that_opens_does_not_perform_earlier_commands(browser: object, animator: StandIn) -> None:
    animator.receive(command_result(1, animator.clock.now_ns(), "demo/slides/next"))
    with opened(browser, animator) as first:
        tick(animator)  # the service loop wakes up when the first page opens
        with opened(browser, animator) as second:
            for visit in (first, second):
                visit.evaluate("location.hash = 'slides'")
                visit.until(lambda visit=visit: visit.page.is_visible("#slides"), "the slide show")
                visit.until(lambda visit=visit: visit.evaluate("zenocap.slides.seen?.size") == 1, "the earlier command")
                assert visit.text("#slide-number") == "1 / 6"
            animator.receive(command_result(2, animator.clock.now_ns(), "demo/slides/next"))
            for visit in (first, second):
                visit.until(lambda visit=visit: visit.text("#slide-number") == "2 / 6", "the next slide")


def test_the_slide_show_fits_the_window(visit: Visit) -> None:
    outside = """[...document.querySelectorAll('#slides *')].filter((one) => {
        const box = one.getBoundingClientRect();
        return box.width && (box.left < 0 || box.right > innerWidth + 0.5 || box.bottom > innerHeight + 0.5);
    }).map((one) => one.outerHTML.slice(0, 80))"""
    visit.evaluate("location.hash = 'slides'")
    visit.until(lambda: visit.page.is_visible("#slides"), "the slide show")
    for width in (1100, 390):
        visit.page.set_viewport_size({"width": width, "height": 780})
        visit.until(lambda width=width: visit.evaluate("innerWidth") == width, "the new size")
        visit.page.keyboard.press("Home")
        for number in range(1, 7):
            assert visit.text("#slide-number") == f"{number} / 6"
            assert visit.evaluate(outside) == []
            visit.page.keyboard.press("ArrowRight")


def test_recording_is_requested_and_shown(visit: Visit, animator: StandIn) -> None:
    visit.page.click("[data-tab=takes]")
    visit.until(lambda: (tick(animator), visit.text("#record") == "Stop recording")[1], "it is recording at first")
    animator.send_health(recording=False)
    visit.until(lambda: (tick(animator), visit.text("#record") == "Record a take")[1], "nothing is recorded")
    visit.page.click("#record")
    requests: list[Request] = []
    visit.until(lambda: bool(requests.extend(animator.bridge.requests()) or requests), "the request")
    animator.send_health(recording=True, log=321)
    visit.until(lambda: (tick(animator), visit.text("#record") == "Stop recording")[1], "it is recording")
    assert "321 messages" in visit.text("#recording-state")
    animator.clock.advance(10**9)  # earlier it is refused with a notice
    visit.page.click("#record")
    visit.until(lambda: (requests.extend(animator.bridge.requests()), len(requests) == 2)[1], "the second request")
    assert [request.what for request in requests] == ["record", "stop_recording"]


@pytest.mark.nightly  # starts a replay
def test_a_file_that_is_not_a_take_is_reported_and_the_page_is_live_again(visit: Visit) -> None:
    visit.page.click("[data-tab=takes]")
    visit.page.click("#takes button")
    visit.until(lambda: visit.page.is_visible("#player-problem"), "the problem is shown")
    assert "walk-1.mcap" in visit.text("#player-problem")
    visit.until(lambda: visit.text("#feed") == "live", "live again")


def test_the_page_shows_a_lost_connection_and_reconnects(browser: object, tmp_path: Path) -> None:
    with ExitStack() as visits:
        with stand_in(tmp_path) as first:
            visit = visits.enter_context(opened(browser, first, expected="WebSocket connection to .* failed"))
        visit.until(lambda: visit.page.is_visible("#alert"), "the alarm")
        assert "no connection" in visit.text("#alert")
        with stand_in(tmp_path, port=int(first.address.split(":")[2].strip("/"))) as second:
            second.begin()
            visit.until(lambda: not visit.page.is_visible("#alert"), "the connection is back")


def test_text_from_the_network_is_never_markup(visit: Visit, animator: StandIn) -> None:
    bad = "<img src=x onerror=alert(1)><script>alert(2)</script>"
    animator.receive(health("viewer", "1", animator.clock.now_ns(), bad))
    visit.until(lambda: (tick(animator), bad in visit.text("#services"))[1], "the text is shown unchanged")
    assert visit.page.locator("#services img").count() == 0


def test_the_resolution_follows_the_drawing_time(visit: Visit) -> None:
    for before, took_ms, after in ((0, 200, 3), (0, 70, 1), (0, 44, 0), (1, 3, 0), (3, 30, 3)):
        script = f"""(() => {{ const {{scene}} = zenocap; scene.times = []; scene.quality = {before};
            for (let k = 0; k < 4; k++) scene.adaptResolution({took_ms}); return scene.quality; }})()"""
        assert visit.evaluate(script) == after, (before, took_ms)


def test_every_text_has_contrast_in_every_window(visit: Visit, animator: StandIn) -> None:
    """In each tab, in the dialog that measures, and on each slide."""
    animator.receive(health("viewer", "1", animator.clock.now_ns(), "no person in view", dropped_frames=3))
    visit.evaluate("zenocap.scene.requestDraw = () => {}")  # drawn by the processor it takes most of the time
    for opener in ("[data-tab=takes]", "[data-tab=view]", "[data-tab=setup]", "#measure", "#slides-open"):
        visit.evaluate(f"document.querySelector('{opener}').click()")
        visit.check_windows()
        visit.evaluate("zenocap.dialog.close()")
    for _ in range(5):
        visit.page.keyboard.press("ArrowRight")
        visit.check_windows()


def test_angles_are_0_in_the_hanging_arm_and_the_straight_knee_and_grow_as_they_lift_and_bend(
    visit: Visit, animator: StandIn
) -> None:
    shown = "[...document.querySelectorAll('figure')].map((one) => one.textContent)"
    bent = TEN_PARTS.neutral.copy()
    bent[[TEN_PARTS.index[f"{side}_knee.x"] for side in ("right", "left")]] = -0.5
    for frame, angles, words in (
        (60, T_POSE.angles, {"arm elevation90° 90°", "knee flexion0° 0°"}),
        (61, bent, {"arm elevation0° 0°", "knee flexion29° 29°"}),
    ):
        animator.receive(bap(frame, animator.clock.now_ns(), Pose(T_POSE.position, angles)))
        sees(visit, frame)
        visit.until(lambda words=words: words <= set(visit.evaluate(shown)), str(words))


PLOTTED = """[...document.querySelectorAll('#plots canvas')].flatMap((one) =>
  [...one.getContext('2d').getImageData(0, 0, one.width, one.height).data])"""


def test_curves_have_the_colours_of_their_legend_and_the_room_is_light_where_the_colour_scheme_is(
    visit: Visit, animator: StandIn
) -> None:
    animator.send_frame_set(0.5)
    sees(visit, 2)
    wall, floor = np.array([640.0, 40.0]), expected_px(visit, np.array([0.7, 0.0, -1.0]))
    for x, y in (wall, floor):
        assert visit.evaluate(f"document.elementFromPoint({x}, {y}).id") == "scene"
    for scheme, side in product(SCHEMES, ("right", "left")):
        visit.page.emulate_media(color_scheme=scheme)
        colour = visit.evaluate(f"getComputedStyle(document.querySelector('#plots .{side}')).color")
        rgba = np.array([*re.findall(r"\d+", str(colour)), 255], dtype=float)

        def drawn(rgba: Floats = rgba) -> bool:
            return bool((np.abs(np.reshape(visit.evaluate(PLOTTED), (-1, 4)) - rgba).max(axis=1) < 20).any())

        visit.until(drawn, f"{side}, {scheme}: {colour}")
        visit.until(lambda light=scheme == "light": lit(visit, wall, floor) == [light, light], f"a room that is {scheme}")


def lit(visit: Visit, *places: Floats) -> list[bool]:
    """Whether places on the page, as they are seen, are nearer to white than to black."""
    picture = cv2.imdecode(np.frombuffer(visit.page.screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
    return [bool(picture[round(y), round(x)] > 127) for x, y in places]


def test_the_advice_is_calm_while_a_person_is_tracked_and_grey_limbs_are_explained(visit: Visit, animator: StandIn) -> None:
    shown = "((one) => [one.textContent, one.classList.contains('calm')])(document.getElementById('advice'))"
    waiting, missing = "waiting for the T-pose in both views", "tracking, without viewer 2"
    states = ((waiting, m.Phase.AWAITING_PERSON), (missing, m.Phase.TRACKING), ("tracking", m.Phase.TRACKING))
    for state, phase in states:
        animator.receive(health("integrator", "main", animator.clock.now_ns(), state, phase))
        expected = [state, state == "tracking"]
        visit.until(lambda expected=expected: (tick(animator), visit.evaluate(shown) == expected)[1], f"calm: {expected}")
    assert "grey: lost" in str(visit.evaluate("document.getElementById('colours').textContent"))
