"""The page of postures in a real browser: three examples each of three postures are labelled, trained and tried.

Skipped where there is no Chromium, or no playwright to drive it.
"""

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.support.posture_takes import NAMES, REPETITIONS, posture_spans, posture_take
from tests.tools.posture_page.test_session import reader_of
from zenocap.common.rig.animator import PageTable
from zenocap.services.recognizer.model_file import read_model
from zenocap.services.recognizer.training.manifest import read_manifest
from zenocap.tools.posture_page.live_trial import LiveTrial
from zenocap.tools.posture_page.manifest_file import ManifestFile
from zenocap.tools.posture_page.motion_view import open_motion
from zenocap.tools.posture_page.page import PosturePage
from zenocap.tools.posture_page.session import Publish, Session

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_S = 90.0


@contextmanager
def served(take: Path, manifest: Path, live: Callable[[Publish], LiveTrial] | None = None) -> Iterator[PosturePage]:
    """A page that runs in a thread.  live: its live trial."""
    takes, file, ended = [open_motion(take)], ManifestFile(manifest), threading.Event()

    def session(publish: Publish) -> Session:
        trial = None if live is None else live(publish)
        return Session(takes, file, "anna", reader_of(manifest), publish, live=trial)

    page = PosturePage(takes, session, PageTable(port=0))
    page.open()
    thread = threading.Thread(target=page.run, args=(ended.is_set,), daemon=True)
    thread.start()
    try:
        yield page
    finally:
        ended.set()
        thread.join(5.0)
        page.close()


class Visit:
    """An open page.  problems: errors on its console.  foreign: URLs of other servers that it requested."""

    def __init__(self, browser, served_page: PosturePage, width: int = 1100, scheme: str = "dark") -> None:
        self.page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.problems: list[str] = []
        self.foreign: list[str] = []
        own = served_page.address.removeprefix("http://").partition("/")[0]
        self.page.on("request", lambda one: None if own in one.url or "data:" in one.url else self.foreign.append(one.url))
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", lambda line: self.problems.append(line.text) if line.type == "error" else None)
        self.page.goto(served_page.address)
        self.until(lambda: self.page.locator("#proposals .segment, #labels .segment").count() > 0, "proposals")

    def until(self, condition: Callable[[], bool], text: str) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < end_s, f"not within {PATIENCE_S:g} s: {text}; {self.problems}"
            self.page.wait_for_timeout(50)

    def close(self) -> None:
        self.page.close()
        assert self.problems == []
        assert self.foreign == []


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as driver:
        one = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield one
        one.close()


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return posture_take(tmp_path_factory.mktemp("taught") / "monday.mcap")


def test_three_examples_are_labelled_with_the_keyboard_trained_and_tried(browser, take, tmp_path) -> None:
    manifest = tmp_path / "examples.csv"
    with served(take, manifest) as page:
        visit = Visit(browser, page)
        one, labels = visit.page, visit.page.locator("#labels .segment")
        visit.until(lambda: one.evaluate("zenocap.scene.capsules.length") >= 10, "the actor")
        one.keyboard.press("n")  # the first proposal: the arms are lowered from the T-pose
        one.keyboard.press("n")
        start_s = one.evaluate("zenocap.state.selected.start")
        one.keyboard.press("Space")
        visit.until(lambda: one.evaluate("zenocap.state.time") > start_s + 0.2, "the stretch is played")
        one.keyboard.press("Space")
        for done, name in enumerate(NAMES * REPETITIONS, 1):
            one.keyboard.press("Enter")
            one.keyboard.type(name)
            one.keyboard.press("Enter")
            visit.until(
                lambda done=done: labels.count() == done and one.evaluate("!zenocap.state.pending"), f"label {done}"
            )
        rows = read_manifest(manifest)  # saved at once
        assert [(row.posture, row.person) for row in rows] == [(name, "anna") for name in NAMES * REPETITIONS]
        for row, (name, begin_s, end_s) in zip(rows, posture_spans(), strict=True):
            assert row.start < (begin_s + end_s) / 2 < row.end, (row, name)

        labels.nth(0).click()
        one.keyboard.press("Delete")
        visit.until(lambda: labels.count() == 8, "the deletion")
        one.keyboard.press("u")
        visit.until(lambda: labels.count() == 9, "the undo")

        labels.nth(1).click()
        box = one.locator("#end").bounding_box()
        one.mouse.move(box["x"] + box["width"] / 2, box["y"] + 30)
        one.mouse.down()
        one.mouse.move(box["x"] + box["width"] / 2 - 6, box["y"] + 30, steps=3)
        one.mouse.up()
        visit.until(lambda: read_manifest(manifest)[1].end < rows[1].end, "the moved end")

        one.click("#train")
        visit.until(lambda: one.is_visible("#live"), "the model")
        assert set(read_model(manifest.with_suffix(".postures")).labels) == set(NAMES)
        lines = one.inner_text("#training-lines")
        assert "of 9 examples are recognized by a model without that repetition" in lines
        assert "other people were not tested" in lines
        assert str(manifest.with_suffix(".postures")) in one.inner_text("#command")
        visit.until(lambda: one.locator("#found .segment").count() >= 8, "the trial")
        right = one.locator("#found .segment.right").count()
        assert right >= 8
        assert f"{right} of 9 labels are recognized" in one.inner_text("#trial-lines")
        one.click("#try")
        visit.until(lambda: one.locator("#found .segment.right").count() == right, "the same result again")
        visit.close()


def test_what_is_refused_is_one_line_and_changes_nothing(browser, take, tmp_path) -> None:
    manifest = tmp_path / "examples.csv"
    with served(take, manifest) as page:
        visit = Visit(browser, page)
        one = visit.page
        one.click("#train")
        visit.until(lambda: "no posture is labelled" in one.inner_text("#notice"), "the reason")
        one.keyboard.press("n")
        one.keyboard.press("Enter")
        one.keyboard.press("Enter")
        visit.until(lambda: "posture = ''" in one.inner_text("#notice"), "the empty name")
        assert not manifest.exists()
        one.keyboard.press("Enter")
        one.keyboard.type("wave")
        one.keyboard.press("Enter")
        visit.until(lambda: one.locator("#labels .segment").count() == 1, "the label")
        one.click("#train")
        visit.until(lambda: "only 'wave' is labelled" in one.inner_text("#notice"), "the single posture")
        second = Visit(browser, page)
        visit.until(lambda: one.is_visible("#tabs"), "the second tab is named")
        second.page.locator("#labels .segment").click()
        second.page.keyboard.press("Delete")
        visit.until(lambda: one.locator("#labels .segment").count() == 0, "the deletion in the other tab")
        second.close()
        visit.close()


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (390, "dark"), (1100, "light"), (1920, "dark")])
def test_nothing_is_wider_than_the_window_and_everything_has_a_name(browser, take, tmp_path, width, scheme) -> None:
    with served(take, tmp_path / "examples.csv") as page:
        visit = Visit(browser, page, width, scheme)
        one = visit.page
        assert one.evaluate("document.documentElement.scrollWidth") <= width
        ink, back = (
            np.array(eval(one.evaluate(f"getComputedStyle(document.body).{key}").removeprefix("rgb")), dtype=float)
            for key in ("color", "backgroundColor")
        )
        assert np.abs(ink - back).min() > 150
        assert (back.mean() > 128) == (scheme == "light")
        nameless = one.evaluate(
            "[...document.querySelectorAll('button, input, select, [role=slider]')].filter((one) => "
            "!(one.getAttribute('aria-label') || one.textContent.trim() || one.labels?.length)).map((one) => one.outerHTML)"
        )
        assert nameless == []
        visit.close()
