"""Saving a take on its page in a browser: marks, formats, progress, download, and what is refused."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.pose_tracks import moving
from tests.support.saved_files import READERS
from tests.system.test_page_chromium import CHROMIUM, FLAGS, PATIENCE_S, SIZE, playwright
from tests.system.test_show_chromium import until
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.show import TakePage

pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
RATE, POSES = 20.0, 160
SAVING_S = 150.0  # for a command beside Chromium without a graphics card


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("takes")


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator["playwright.Page"]:
    """Page on a take of 8 s, with a token."""
    take = write_take(folder / "my walk.mcap", messages_of_track(moving(POSES, rate=RATE)))
    shown = TakePage(take, PageTable(port=0, token="a-token-of-sixteen-letters"))
    shown.open()
    try:
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            visited = browser.new_page(viewport=SIZE, color_scheme="dark", accept_downloads=True)
            problems: list[str] = []
            visited.on("pageerror", lambda error: problems.append(str(error)))
            visited.goto(shown.address)
            until(visited, lambda: visited.is_visible("#save-box"), "the choice of formats")
            until(visited, lambda: visited.evaluate("Boolean(zenocap.state.shown_s)"), "a pose")
            yield visited
            assert problems == []
            browser.close()
    finally:
        shown.close()


def saved(page: "playwright.Page") -> str:
    """State of the file after the work on it has ended."""
    ended = ("done", "failed", "cancelled")
    until(page, lambda: page.get_attribute("#saving", "data-state") in ended, "the end of the work", SAVING_S)
    return page.inner_text("#saving-text")


def save(page: "playwright.Page") -> str:
    page.evaluate("document.getElementById('saving').dataset.state = ''")
    page.click("#save-go")
    return saved(page)


def go_to(page: "playwright.Page", position_s: float) -> None:
    if page.get_attribute("#pause", "aria-label") == "pause":
        page.click("#pause")
        until(page, lambda: page.get_attribute("#pause", "aria-label") == "play", "a pause")
    page.wait_for_timeout(500)  # states of the player from before the pause have come
    page.evaluate(f"zenocap.player.seek({position_s})")
    places = "[zenocap.player.place.position_s, zenocap.player.last.position_s]"
    until(
        page,
        lambda: all(abs(place_s - position_s) < 0.03 for place_s in page.evaluate(places)),
        f"the pose at {position_s:g} s",
    )


def test_the_part_between_two_marks_is_saved_as_tables_and_offered(page: "playwright.Page", folder: Path) -> None:
    for key, place_s in (("i", 2.0), ("o", 5.0)):
        go_to(page, place_s)
        page.keyboard.press(key)
    assert (page.input_value("#save-start"), page.input_value("#save-end")) == ("2.000", "5.000")
    assert page.is_visible("#part i")
    page.keyboard.press("s")
    assert page.evaluate("document.activeElement.id") == "save-kind"
    page.select_option("#save-kind", "npz")
    page.select_option("#save-joints", "coco")
    page.fill("#save-smooth", "6")
    text = save(page)
    assert text.startswith("saved beside the take as my walk_2.00-5.00s.npz: 61 frames, 40 to 100"), text
    with np.load(folder / "my walk_2.00-5.00s.npz") as found:
        assert found["frame"].tolist() == list(range(40, 101))
        assert "Nose" in found["joint_names"].tolist()
    with page.expect_download(timeout=1000 * PATIENCE_S) as download:
        page.click("#saving-get")
    assert download.value.suggested_filename == "my walk_2.00-5.00s.npz"
    assert Path(download.value.path()).read_bytes() == (folder / "my walk_2.00-5.00s.npz").read_bytes()


@pytest.mark.parametrize("kind", list(READERS))
def test_files_of_other_programs_are_read_by_them(kind: str, page: "playwright.Page", folder: Path) -> None:
    """The hip, and the right wrist or the flexion of its elbow, at the poses of the part."""
    suffix, read = READERS[kind]
    page.select_option("#save-kind", kind)
    for box, value in (("#save-start", "2"), ("#save-end", "5"), ("#save-smooth", "")):
        page.fill(box, value)
    for choice, value in (("#save-axes", "y-up"), ("#save-joints", "zenocap")):
        if page.is_visible(choice):
            page.select_option(choice, value)
    name = f"my walk_2.00-5.00s{suffix}"
    assert save(page).startswith(f"saved beside the take as {name}: 61 frames, 40 to 100"), page.inner_text("#saving-text")
    times_s, found = read(folder / name)
    track = moving(POSES, rate=RATE)
    rows = slice(40, 101)
    np.testing.assert_allclose(times_s - times_s[0], track.times_s[rows] - track.times_s[40], atol=1e-6)
    places = track.trajectories()
    at = {joint: places.points[rows, places.names.index(joint)] for joint in ("Hip", "RShoulder", "RElbow", "RWrist")}
    arms = [at["RElbow"] - at["RShoulder"], at["RWrist"] - at["RElbow"]]
    upper, lower = (arm / np.linalg.norm(arm, axis=1, keepdims=True) for arm in arms)
    expected = {**at, "elbow": np.degrees(np.arccos(np.sum(upper * lower, axis=1)))}
    assert "Hip" in found
    assert len(found) == 2
    for what, values in found.items():
        np.testing.assert_allclose(values, expected[what], atol=0.02 if what == "elbow" else 1e-5, err_msg=what)


def test_a_file_of_the_same_name_is_never_replaced(page: "playwright.Page", folder: Path) -> None:
    page.click("#save-whole")
    assert page.is_hidden("#part")
    page.fill("#save-smooth", "")
    page.select_option("#save-kind", "bvh")
    (folder / "my walk.bvh").write_text("mine")
    assert save(page).startswith("saved beside the take as my walk-2.bvh: 160 frames")
    assert (folder / "my walk.bvh").read_text() == "mine"
    assert (folder / "my walk-2.bvh").read_text().startswith("HIERARCHY")


def test_what_cannot_be_done_is_one_line(page: "playwright.Page", folder: Path) -> None:
    before = sorted(folder.iterdir())
    page.select_option("#save-kind", "csv")
    page.fill("#save-smooth", "11")
    text = save(page)
    assert text.startswith("not saved: ")
    assert "11" in text
    assert "\n" not in text
    page.fill("#save-smooth", "")
    page.fill("#save-start", "100")
    assert save(page) == "not saved: the part has no pose: allowed: between 0.00 and 7.95 s"
    page.fill("#save-start", "3")
    page.fill("#save-end", "2")
    page.click("#save-go")
    assert page.evaluate("document.getElementById('save-end').validationMessage") == "allowed: 3 s or later"
    page.click("#save-whole")
    assert sorted(folder.iterdir()) == before


def test_a_picture_and_a_film_with_progress_that_is_cancelled(page: "playwright.Page", folder: Path) -> None:
    page.select_option("#save-kind", "png")
    page.select_option("#save-size", "640x360")
    go_to(page, 3.0)
    assert save(page) == "saved beside the take as my walk_3.00s.png: 1 picture"
    assert (folder / "my walk_3.00s.png").read_bytes().startswith(b"\x89PNG")
    before = sorted(folder.iterdir())
    page.select_option("#save-kind", "mp4")
    page.select_option("#save-size", "1920x1080")
    page.click("#save-go")
    until(page, lambda: "of 160 pictures" in page.inner_text("#saving-text"), "the progress of a film", SAVING_S)
    assert page.is_disabled("#save-go")
    page.click("#saving-cancel")
    assert saved(page) == "my walk.mp4: cancelled: nothing was saved"
    assert sorted(folder.iterdir()) == before
    page.fill("#save-start", "1")
    page.fill("#save-end", "1.5")
    page.select_option("#save-size", "640x360")
    assert save(page) == "saved beside the take as my walk_1.00-1.50s.mp4: 11 pictures"


def test_controls_have_names_for_screen_readers(page: "playwright.Page") -> None:
    page.select_option("#save-kind", "trc")
    for role, name in (
        ("combobox", "format"), ("combobox", "joint centres"), ("combobox", "axes"), ("spinbutton", "smoothing, Hz"),
        ("spinbutton", "from"), ("spinbutton", "to"), ("button", "Save"), ("button", "the part to save starts here"),
        ("button", "the part to save ends here"), ("button", "save …"), ("form", "Save this take as"),
    ):  # fmt: skip
        assert page.get_by_role(role, name=name, exact=True).count() == 1, name  # type: ignore[arg-type]
