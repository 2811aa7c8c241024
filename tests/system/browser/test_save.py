"""Saving a take on its page in a browser: marks, formats, progress, download, and what is refused."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.browser import PATIENCE_S, Visit, visited
from tests.support.package_rows import add_row
from tests.support.pose_tracks import moving
from tests.support.saved_files import READERS
from zenocap.common.formats.export_format import FORMATS, ExportFormat
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.save_command import format_choices
from zenocap.services.animator.show import TakePage

pytestmark = pytest.mark.nightly
RATE, POSES = 20.0, 160


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("takes")


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    """Page on a take of 8 s, with a token."""
    take = write_take(folder / "my walk.mcap", messages_of_track(moving(POSES, rate=RATE)))
    shown = TakePage(take, PageTable(port=0, token="a-token-of-sixteen-letters"))
    shown.open()
    yield shown.address
    shown.close()


@pytest.fixture
def visit(browser: object, address: str) -> Iterator[Visit]:
    with visited(browser, address) as one:
        one.until(lambda: one.page.is_visible("#save-box"), "the choice of formats")
        one.until(lambda: one.evaluate("Boolean(zenocap.state.shown_s)"), "a pose")
        yield one


def saved(visit: Visit) -> str:
    """State of the file after the work on it has ended."""
    ended = ("done", "failed", "cancelled")
    visit.until(lambda: visit.page.get_attribute("#saving", "data-state") in ended, "the end of the work")
    return visit.text("#saving-text")


def save(visit: Visit) -> str:
    visit.evaluate("document.getElementById('saving').dataset.state = ''")
    visit.page.click("#save-go")
    return saved(visit)


def go_to(visit: Visit, position_s: float) -> None:
    page = visit.page
    visit.until(lambda: page.evaluate("zenocap.player.last !== null"), "the player")
    if page.get_attribute("#pause", "aria-label") == "pause":
        page.click("#pause")
        visit.until(lambda: page.get_attribute("#pause", "aria-label") == "play", "a pause")
    page.evaluate(f"zenocap.player.seek({position_s}); zenocap.player.last.asked = true")  # before its next state
    places = "[zenocap.player.place.position_s, zenocap.player.last.asked ? -1 : zenocap.player.last.position_s]"
    visit.until(
        lambda: all(abs(place_s - position_s) < 0.03 for place_s in page.evaluate(places)), f"the pose at {position_s:g} s"
    )


def test_the_part_between_two_marks_is_saved_as_tables_and_offered(visit: Visit, folder: Path) -> None:
    page = visit.page
    for key, place_s in (("i", 2.0), ("o", 5.0)):
        go_to(visit, place_s)
        page.keyboard.press(key)
    assert (page.input_value("#save-start"), page.input_value("#save-end")) == ("2.000", "5.000")
    assert page.is_visible("#part i")
    page.keyboard.press("s")
    assert page.evaluate("document.activeElement.id") == "save-kind"
    page.select_option("#save-kind", "npz")
    page.select_option("#save-joints", "coco")
    page.fill("#save-smooth", "6")
    text = save(visit)
    assert text.startswith("saved beside the take as my walk_2.00-5.00s.npz: 61 frames, 40 to 100"), text
    with np.load(folder / "my walk_2.00-5.00s.npz") as found:
        assert found["frame"].tolist() == list(range(40, 101))
        assert "Nose" in found["joint_names"].tolist()
    with page.expect_download(timeout=1000 * PATIENCE_S) as download:
        page.click("#saving-get")
    assert download.value.suggested_filename == "my walk_2.00-5.00s.npz"
    assert Path(download.value.path()).read_bytes() == (folder / "my walk_2.00-5.00s.npz").read_bytes()


@pytest.mark.parametrize("kind", list(READERS))
def test_files_of_other_programs_are_read_by_them(kind: str, visit: Visit, folder: Path) -> None:
    """The hip, and the right wrist or the flexion of its elbow, at the poses of the part."""
    page = visit.page
    suffix, read = READERS[kind]
    page.select_option("#save-kind", kind)
    for box, value in (("#save-start", "2"), ("#save-end", "5"), ("#save-smooth", "")):
        page.fill(box, value)
    for choice, value in (("#save-axes", "y-up"), ("#save-joints", "zenocap")):
        if page.is_visible(choice):
            page.select_option(choice, value)
    name = f"my walk_2.00-5.00s{suffix}"
    assert save(visit).startswith(f"saved beside the take as {name}: 61 frames, 40 to 100"), page.inner_text("#saving-text")
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


def test_a_file_of_the_same_name_is_never_replaced(visit: Visit, folder: Path) -> None:
    page = visit.page
    page.click("#save-whole")
    assert page.is_hidden("#part")
    page.fill("#save-smooth", "")
    page.select_option("#save-kind", "bvh")
    (folder / "my walk.bvh").write_text("mine")
    assert save(visit).startswith("saved beside the take as my walk-2.bvh: 160 frames")
    assert (folder / "my walk.bvh").read_text() == "mine"
    assert (folder / "my walk-2.bvh").read_text().startswith("HIERARCHY")


def test_what_cannot_be_done_is_one_line(visit: Visit, folder: Path) -> None:
    page = visit.page
    before = sorted(folder.iterdir())
    page.select_option("#save-kind", "csv")
    page.fill("#save-smooth", "11")
    text = save(visit)
    assert text.startswith("not saved: ")
    assert "11" in text
    assert "\n" not in text
    visit.check_windows()
    page.fill("#save-smooth", "")
    page.fill("#save-start", "100")
    assert save(visit) == "not saved: the part has no pose: allowed: between 0.00 and 7.95 s"
    page.fill("#save-start", "3")
    page.fill("#save-end", "2")
    page.click("#save-go")
    assert page.evaluate("document.getElementById('save-end').validationMessage") == "allowed: 3 s or later"
    page.click("#save-whole")
    assert sorted(folder.iterdir()) == before


def test_a_picture_and_a_film_with_progress_that_is_cancelled(visit: Visit, folder: Path) -> None:
    page = visit.page
    page.select_option("#save-kind", "png")
    page.select_option("#save-size", "640x360")
    go_to(visit, 3.0)
    assert save(visit) == "saved beside the take as my walk_3.00s.png: 1 picture"
    assert (folder / "my walk_3.00s.png").read_bytes().startswith(b"\x89PNG")
    before = sorted(folder.iterdir())
    page.select_option("#save-kind", "mp4")
    page.select_option("#save-size", "1920x1080")
    page.click("#save-go")
    visit.until(lambda: "of 160 pictures" in page.inner_text("#saving-text"), "the progress of a film")
    assert page.is_disabled("#save-go")
    page.click("#saving-cancel")
    assert saved(visit) == "my walk.mp4: cancelled: nothing was saved"
    assert sorted(folder.iterdir()) == before
    page.fill("#save-start", "1")
    page.fill("#save-end", "1.5")
    page.select_option("#save-size", "640x360")
    assert save(visit) == "saved beside the take as my walk_1.00-1.50s.mp4: 11 pictures"


def test_controls_have_names_for_screen_readers(visit: Visit) -> None:
    page = visit.page
    page.select_option("#save-kind", "trc")
    for role, name in (
        ("combobox", "format"), ("combobox", "joint centres"), ("combobox", "axes"), ("spinbutton", "smoothing, Hz"),
        ("spinbutton", "from"), ("spinbutton", "to"), ("button", "Save"), ("button", "the part to save starts here"),
        ("button", "the part to save ends here"), ("button", "save …"), ("form", "Save this take as"),
    ):  # fmt: skip
        assert page.get_by_role(role, name=name, exact=True).count() == 1, name  # type: ignore[arg-type]


def test_formats_are_those_of_the_table_with_what_each_has_to_choose(
    browser: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = ExportFormat("sto", "more:write", (".sto",), axes=("y-up", "opensim"), points=True, title="STO: <i>OpenSim</i>")
    add_row(monkeypatch, FORMATS, "sto", row)
    shown = TakePage(write_take(tmp_path / "a.mcap", messages_of_track(moving(20, rate=RATE))), PageTable(port=0))
    shown.open()
    try:
        with visited(browser, shown.address) as visit:
            page = visit.page
            visit.until(lambda: page.is_visible("#save-box"), "the choice of formats")
            texts = "[...document.querySelectorAll('#save-poses option')].map((one) => [one.value, one.textContent])"
            assert visit.evaluate(texts) == [[one.name, one.title] for one in format_choices()]
            assert page.input_value("#save-kind") == "bvh"
            boxes = ("#save-joints", "#save-axes", "#save-start", "#save-view", "#save-follow")
            for kind, expected in (
                ("sto", "11100"),
                ("bvh", "01100"),
                ("glb", "00100"),
                ("mp4", "00111"),
                ("png", "00010"),
            ):
                page.select_option("#save-kind", kind)
                assert "".join(str(int(page.is_visible(box))) for box in boxes) == expected, kind
            page.select_option("#save-kind", "sto")
            axes = (
                "[...document.getElementById('save-axes').options].filter((one) => !one.disabled).map((one) => one.value)"
            )
            assert visit.evaluate(axes) == ["y-up", "opensim"]
            assert save(visit).startswith("not saved: the command ended with status 2")  # its process has no such row
    finally:
        shown.close()
