"""Page on a take in a browser: second take, pictures, scrubbing, bars by keys."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.browser import Visit, visited
from tests.support.built_messages import built, silhouette
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.comparison_reader import compare
from zenocap.services.animator.show import TakePage

pytestmark = pytest.mark.core
MOVED_M = np.array([0.3, 0.0, -0.4])  # by 0.5 m
RATE, POSES = 20.0, 160
LEVEL_PER_S = 30.0  # of the grey of a picture
PICTURE_NOW = """(() => {
  const pen = document.querySelector('.view canvas')?.getContext('2d'), {shown_s, picture_s} = zenocap.state;
  return [shown_s ?? 0, picture_s ?? -1, pen?.getImageData(2, 2, 1, 1).data[0] ?? 0];
})()"""


def posture(label: str, start_s: float, end_s: float) -> m.Posture:
    start_ns, end_ns = (START_NS + round(1e9 * time_s) for time_s in (start_s, end_s))
    return m.Posture(
        frame=0, captured_ns=end_ns, label=label, start_ns=start_ns, end_ns=end_ns, log_likelihoods={}, score=1.0,
        margin=0.0,
    )  # fmt: skip


def pictures(time_ns: int) -> Iterator[tuple[str, bytes]]:
    """Grey one of viewer 1, brighter with the time of the take."""
    level = LEVEL_PER_S * (time_ns - START_NS) / 1e9
    yield "1", cv2.imencode(".png", np.full((120, 160, 3), round(level), np.uint8))[1].tobytes()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Page on a take with a second one that stands 0.5 m beside it."""
    folder: Path = tmp_path_factory.mktemp("takes")
    track = moving(POSES, rate=RATE)
    postures = [posture("squat", 1.0, 2.0), posture("kick", 4.0, 5.0), built(m.Verdict, captured_ns=START_NS + 7 * 10**9)]
    masks = [silhouette("1", k, START_NS + round(1e9 * k / RATE), np.eye(120, 160, -60, np.uint8)) for k in range(POSES)]
    messages = sorted([*messages_of_track(track), *masks, *postures], key=lambda message: message.captured_ns)
    one = write_take(folder / "a.mcap", messages)
    other = write_take(folder / "b.mcap", messages_of_track(replace(track, positions=track.positions + MOVED_M)))
    shown = TakePage(one, PageTable(port=0), pictures, compared=lambda ended: compare(one, other, stopped=ended))
    shown.open()
    yield shown.address
    shown.close()


@pytest.fixture
def visit(browser: object, address: str) -> Iterator[Visit]:
    with visited(browser, address) as one:
        one.until(lambda: one.evaluate("zenocap.player.last && zenocap.state.poses.size > 0"), "player and pose")
        one.until(lambda: one.page.locator("#posture-parts i").count() == 2, "the postures")
        yield one


def test_the_second_take_is_drawn_with_its_distances_and_hidden_by_a_key(visit: Visit) -> None:
    page = visit.page
    visit.until(lambda: "mean 500 mm, largest 500 mm" in page.inner_text("#ghost-distance"), "the distances")
    assert page.inner_text("#ghost-take") == "b.mcap"
    assert page.inner_text("#ghost-alignment") == "aligned by recorded times"
    assert page.evaluate("zenocap.ghost.text('RWrist')") == "500 mm from b.mcap"
    assert page.evaluate("zenocap.scene.ghost.length > 0 && zenocap.scene.ghost.every((one) => one.colour[3] < 1)")
    page.keyboard.press("g")
    visit.until(lambda: page.evaluate("zenocap.scene.ghost.length") == 0, "the second take is hidden")
    page.keyboard.press("g")
    visit.until(lambda: page.evaluate("zenocap.scene.ghost.length") > 0, "the second take is shown again")


def test_pictures_follow_the_poses_while_the_take_plays(visit: Visit) -> None:
    seen: set[float] = set()

    def follows() -> bool:
        shown_s, picture_s, level = visit.page.evaluate(PICTURE_NOW)
        drawn_s = (level - 0.15 * 11) / 0.85 / LEVEL_PER_S  # over the dark ground of a view
        if abs(picture_s - shown_s) < 0.5 and abs(drawn_s - picture_s) < 0.1:
            seen.add(picture_s)
        return len(seen) > 4

    visit.until(follows, "pictures of five times")


def test_player_verdict_and_what_is_saved_have_contrast_in_every_window(visit: Visit) -> None:
    page = visit.page
    visit.until(lambda: visit.text("#verdict") == "good", "the verdict")
    visit.evaluate("zenocap.scene.requestDraw = () => {}")
    for rating, kind in (("good", "csv"), ("doubtful", "mp4"), ("unusable", "png")):
        visit.evaluate(f"document.getElementById('verdict').className = 'verdict {rating}'")
        page.select_option("#save-kind", kind)
        visit.check_windows()


@pytest.mark.nightly
def test_postures_are_reached_by_keys(visit: Visit) -> None:
    page = visit.page
    page.focus("#posture-parts i")
    page.keyboard.press("ArrowRight")
    focused = page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert focused.startswith("kick, 4.0 to 5.0 s")
    page.click("#pause")
    visit.until(lambda: page.get_attribute("#pause", "aria-label") == "play", "paused")
    page.focus("#posture-parts i:nth-child(2)")
    page.keyboard.press(" ")  # neither pauses nor plays
    place = "zenocap.player.place?.position_s ?? 0"
    visit.until(lambda: page.evaluate(place) == pytest.approx(4.0, abs=0.1), "the place of the posture")
    assert page.get_attribute("#pause", "aria-label") == "play"
    page.click("#pause")
    visit.until(lambda: page.get_attribute("#pause", "aria-label") == "pause", "plays again")


@pytest.mark.nightly
def test_poses_are_shown_while_the_slider_is_dragged(visit: Visit) -> None:
    page = visit.page
    track = moving(POSES, rate=RATE)
    centres = [joint_centres(track.anatomy, track.bdp, track.pose(row)).ravel() for row in range(POSES)]

    def shown_s() -> float:
        """Time in the take of the pose on the page: that of the recorded pose with the same joint centres."""
        found = np.array(page.evaluate("zenocap.state.poses.get(zenocap.state.source).centres"))
        return int(np.argmin([np.abs(found - one).max() for one in centres])) / RATE

    box = page.locator("#position").bounding_box()
    for k, share in enumerate((0.3, 0.8, 0.5)):
        page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
        if k == 0:
            page.mouse.down()
        visit.until(lambda: abs(shown_s() - float(page.input_value("#position"))) <= 0.2, f"the pose at {share:g}")
        assert float(page.input_value("#position")) == pytest.approx(share * POSES / RATE, abs=0.3)
        visit.until(lambda: page.get_attribute("#pause", "aria-label") == "play", "paused while dragging")
    page.mouse.up()
    visit.until(lambda: page.get_attribute("#pause", "aria-label") == "pause", "plays again")


COUNT_PLOTS = """() => {
  window.plotted = 0;
  const clear = CanvasRenderingContext2D.prototype.clearRect;
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    if (this.canvas.closest('#plots')) window.plotted++;
    return clear.apply(this, box);
  };
}"""

PLOTS_IN_A_SECOND = """async () => {  // ten of the page's periods
  window.plotted = 0;
  for (let k = 0; k < 10; k++) await new Promise((done) => setTimeout(done, 100));
  return window.plotted;
}"""


@pytest.mark.nightly
def test_plots_of_a_paused_take_are_not_drawn_again(visit: Visit) -> None:
    page = visit.page
    page.evaluate(COUNT_PLOTS)
    visit.until(lambda: page.evaluate("window.plotted") > 0, "drawn while playing")
    page.click("#pause")
    visit.until(lambda: page.get_attribute("#pause", "aria-label") == "play", "paused")
    visit.until(lambda: page.evaluate(PLOTS_IN_A_SECOND) == 0, "no more drawn")
    page.set_viewport_size({"width": 1100, "height": 800})
    visit.until(lambda: page.evaluate("window.plotted") > 0, "drawn again in another size")


ROLES = {"button", "checkbox", "combobox", "listbox", "slider", "spinbutton", "tab", "textbox", "link", "image", "radio"}


@pytest.mark.nightly
def test_a_screen_reader_gets_a_name_for_every_control(visit: Visit) -> None:
    """By the accessibility tree of Chromium, of every tab of the panel."""
    page = visit.page
    session = page.context.new_cdp_session(page)
    seen: dict[str, set[str]] = {}
    for tab in page.locator("[data-tab]").all():
        if tab.is_visible():
            tab.click()
        nodes = session.send("Accessibility.getFullAXTree")["nodes"]
        controls = [one for one in nodes if not one["ignored"] and one.get("role", {}).get("value") in ROLES]
        nameless = [one["role"]["value"] for one in controls if not one.get("name", {}).get("value", "").strip()]
        assert nameless == []
        for one in controls:
            seen.setdefault(one["role"]["value"], set()).add(one["name"]["value"])
    assert "position" in " ".join(seen["slider"]).lower()
    assert {"play", "pause"} & seen["button"]
