"""Page of postures in a browser: labelled, trained and tried."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.browser import Visit, visited
from tests.support.networks import free_endpoint, listener
from tests.support.posture_takes import NAMES, REPETITIONS, posture_spans, posture_take
from tests.support.processes import started
from tests.tools.teach.page.test_session import reader_of
from zenocap.common.rig.animator import PageTable
from zenocap.services.recognizer.model_file import find_model, read_model
from zenocap.services.recognizer.training.manifest import read_manifest
from zenocap.tools.teach.dataset.generate import dataset_rig
from zenocap.tools.teach.page.live_trial import LiveTrial, live_trial
from zenocap.tools.teach.page.manifest_file import ManifestFile
from zenocap.tools.teach.page.motion_view import open_motion
from zenocap.tools.teach.page.page import PosturePage
from zenocap.tools.teach.page.session import Publish, TeachingSession

pytestmark = pytest.mark.nightly


@contextmanager
def served(take: Path, manifest: Path, live: Callable[[Publish], LiveTrial] | None = None) -> Iterator[PosturePage]:
    """A page that runs in a thread.  live: its live trial."""
    takes, file, ended = [open_motion(take)], ManifestFile(manifest), threading.Event()

    def session(publish: Publish) -> TeachingSession:
        trial = None if live is None else live(publish)
        return TeachingSession(takes, file, "anna", reader_of(manifest), publish, live=trial)

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


@contextmanager
def opened(browser, page: PosturePage) -> Iterator[Visit]:
    with visited(browser, page.address, 1100, 900) as one:
        one.until(lambda: one.page.locator("#proposals .segment, #labels .segment").count() > 0, "proposals")
        yield one


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return posture_take(tmp_path_factory.mktemp("taught") / "monday.mcap")


def test_three_examples_are_labelled_with_the_keyboard_trained_and_tried(browser, take, tmp_path) -> None:
    manifest = tmp_path / "examples.csv"
    with served(take, manifest) as page, opened(browser, page) as visit:
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


def test_what_is_refused_is_one_line_and_changes_nothing(browser, take, tmp_path) -> None:
    manifest = tmp_path / "examples.csv"
    with served(take, manifest) as page, opened(browser, page) as visit:
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
        with opened(browser, page) as second:
            visit.until(lambda: one.is_visible("#tabs"), "the second tab is named")
            second.page.locator("#labels .segment").click()
            second.page.keyboard.press("Delete")
            visit.until(lambda: one.locator("#labels .segment").count() == 0, "the deletion in the other tab")


def test_the_whole_take_is_in_view_at_first_and_everything_has_a_name_in_every_window(browser, take, tmp_path) -> None:
    beyond = "(({scrollWidth, clientWidth}) => scrollWidth - clientWidth)(document.getElementById('scroll'))"
    ends = "(({start_s, end_s}) => [start_s, end_s].map((time) => zenocap.timeline.share(time)))(zenocap.timeline.take)"
    with served(take, tmp_path / "examples.csv") as page, opened(browser, page) as visit:
        one = visit.page
        visit.check_windows()
        assert one.evaluate(ends) == [0, 100]
        one.keyboard.press("+")
        assert one.evaluate(beyond) > 100
        one.reload()
        visit.until(lambda: one.locator("#proposals .segment").count() > 0, "proposals")
        assert one.evaluate(beyond) == 0
        nameless = one.evaluate(
            "[...document.querySelectorAll('button, input, select, [role=slider]')].filter((one) => "
            "!(one.getAttribute('aria-label') || one.textContent.trim() || one.labels?.length)).map((one) => one.outerHTML)"
        )
        assert nameless == []


def test_the_postures_of_a_running_rig_are_shown_on_the_page(browser, take, tmp_path) -> None:
    manifest = tmp_path / "examples.csv"
    ManifestFile(manifest).model.write_bytes(find_model("fifteen").read_bytes())  # as if it was trained earlier
    endpoint = free_endpoint()

    def live(publish: Publish) -> LiveTrial:
        return live_trial(dataset_rig("truth"), listener(endpoint), lambda update: publish("live", update))

    with served(take, manifest, live) as page, opened(browser, page) as visit:
        one = visit.page
        button = one.locator("#try-live")
        assert button.text_content() == "Try live on rig demo"
        button.click()
        visit.until(lambda: "no poses come from rig demo" in one.text_content("#live-text"), "no poses")
        network = ("--mode", "peer", "--connect", endpoint, "--no-multicast-scouting")
        with started(["replay", take, "--rate", "4", *network], tmp_path):
            visit.until(lambda: one.text_content("#live-text") == "recognizing", "poses")
            visit.until(lambda: all(name in one.text_content("#live-counts") for name in NAMES), "every posture")
            assert one.locator("#live-now b").text_content() in NAMES
            assert "% confident" in one.text_content("#live-now span")
        button.click()
        visit.until(lambda: button.text_content() == "Try live on rig demo", "the end")
        assert one.text_content("#live-text") == ""
