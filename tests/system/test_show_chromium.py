"""The page on a take in a browser: a second take beside it, scrubbing, and the bars under the position by keys."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.pose_tracks import moving
from tests.system.test_page_chromium import CHROMIUM, FLAGS, PATIENCE_S, SIZE, playwright
from zenocap.common import messages as m
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.comparison_reader import compare
from zenocap.services.animator.show import TakePage

pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
MOVED_M = np.array([0.3, 0.0, -0.4])  # by 0.5 m
RATE, POSES = 20.0, 160


def posture(label: str, start_s: float, end_s: float) -> m.Posture:
    start_ns, end_ns = (START_NS + round(1e9 * time_s) for time_s in (start_s, end_s))
    return m.Posture(
        frame=0, captured_ns=end_ns, label=label, start_ns=start_ns, end_ns=end_ns, log_likelihoods={}, score=1.0,
        margin=0.0,
    )  # fmt: skip


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator["playwright.Page"]:
    """Page on a take with a second one that stands 0.5 m beside it."""
    folder: Path = tmp_path_factory.mktemp("takes")
    track = moving(POSES, rate=RATE)
    postures = [posture("squat", 1.0, 2.0), posture("kick", 4.0, 5.0)]
    messages = sorted([*messages_of_track(track), *postures], key=lambda message: message.captured_ns)
    one = write_take(folder / "a.mcap", messages)
    other = write_take(folder / "b.mcap", messages_of_track(replace(track, positions=track.positions + MOVED_M)))
    shown = TakePage(one, PageTable(port=0), compared=lambda ended: compare(one, other, stopped=ended))
    shown.open()
    try:
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            visited = browser.new_page(viewport=SIZE, color_scheme="dark")
            problems: list[str] = []
            visited.on("pageerror", lambda error: problems.append(str(error)))
            visited.goto(shown.address)
            yield visited
            assert problems == []
            browser.close()
    finally:
        shown.close()


def until(page: "playwright.Page", condition: Callable[[], bool], text: str, patience_s: float = PATIENCE_S) -> None:
    end_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < end_s, f"not within {patience_s:g} s: {text}"
        page.wait_for_timeout(30)


def test_the_second_take_is_drawn_with_its_distances_and_hidden_by_a_key(page: "playwright.Page") -> None:
    until(page, lambda: "mean 500 mm, largest 500 mm" in page.inner_text("#ghost-distance"), "the distances")
    assert page.inner_text("#ghost-take") == "b.mcap"
    assert page.inner_text("#ghost-alignment") == "aligned by recorded times"
    assert page.evaluate("zenocap.ghost.text('RWrist')") == "500 mm from b.mcap"
    assert page.evaluate("zenocap.scene.ghost.length > 0 && zenocap.scene.ghost.every((one) => one.colour[3] < 1)")
    page.keyboard.press("g")
    until(page, lambda: page.evaluate("zenocap.scene.ghost.length") == 0, "the second take is hidden")
    page.keyboard.press("g")
    until(page, lambda: page.evaluate("zenocap.scene.ghost.length") > 0, "the second take is shown again")


def test_postures_are_reached_by_keys(page: "playwright.Page") -> None:
    until(page, lambda: page.locator("#posture-parts i").count() == 2, "the postures")
    page.focus("#posture-parts i")
    page.keyboard.press("ArrowRight")
    focused = page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert focused.startswith("kick, 4.0 to 5.0 s")
    page.keyboard.press(" ")  # does not pause
    until(page, lambda: 4.0 <= float(page.input_value("#position")) < 6.0, "the place of the posture")
    assert page.get_attribute("#pause", "aria-label") == "pause"


def test_poses_are_shown_while_the_slider_is_dragged(page: "playwright.Page") -> None:
    track = moving(POSES, rate=RATE)
    centres = [joint_centres(track.anatomy, track.bdp, track.pose(row)).ravel() for row in range(POSES)]

    def shown_s() -> float:
        """Time in the take of the pose on the page: that of the recorded pose with the same joint centres."""
        found = np.array(page.evaluate("zenocap.state.poses.get(zenocap.state.source).centres"))
        return int(np.argmin([np.abs(found - one).max() for one in centres])) / RATE

    box = page.locator("#position").bounding_box()
    assert box is not None
    for k, share in enumerate((0.3, 0.8, 0.5)):
        page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
        if k == 0:
            page.mouse.down()
        until(page, lambda: abs(shown_s() - float(page.input_value("#position"))) <= 0.2, f"the pose at {share:g}")
        assert float(page.input_value("#position")) == pytest.approx(share * POSES / RATE, abs=0.3)
        until(page, lambda: page.get_attribute("#pause", "aria-label") == "play", "paused while dragging")
    page.mouse.up()
    until(page, lambda: page.get_attribute("#pause", "aria-label") == "pause", "plays again")


COUNT_PLOTS = """() => {
  window.plotted = 0;
  const clear = CanvasRenderingContext2D.prototype.clearRect;
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    if (this.canvas.closest('#plots')) window.plotted++;
    return clear.apply(this, box);
  };
}"""


def test_plots_of_a_paused_take_are_not_drawn_again(page: "playwright.Page") -> None:
    page.evaluate(COUNT_PLOTS)
    until(page, lambda: page.evaluate("window.plotted") > 0, "drawn while playing")
    page.click("#pause")
    until(page, lambda: page.get_attribute("#pause", "aria-label") == "play", "paused")
    page.wait_for_timeout(1000)
    page.evaluate("window.plotted = 0")
    page.wait_for_timeout(1000)
    assert page.evaluate("window.plotted") == 0
    page.set_viewport_size({"width": 1100, "height": 800})
    until(page, lambda: page.evaluate("window.plotted") > 0, "drawn again in another size")


ROLES = {"button", "checkbox", "combobox", "listbox", "slider", "spinbutton", "tab", "textbox", "link", "image", "radio"}


def test_a_screen_reader_gets_a_name_for_every_control(page: "playwright.Page") -> None:
    """By the accessibility tree of Chromium, of every tab of the panel."""
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
