"""Dropping a take on the page in a browser: it is shown, and the first take again; what is no take is one line."""

import base64
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.pose_tracks import moving
from tests.system.test_page_chromium import CHROMIUM, FLAGS, SIZE, playwright
from tests.system.test_save_chromium import save
from tests.system.test_show_chromium import until
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.show import TakePage

pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
DROP = """([name, content]) => {
  const bytes = Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0));
  const transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name));
  for (const kind of ['dragenter', 'dragover', 'drop'])
    document.body.dispatchEvent(new DragEvent(kind, { dataTransfer: transfer, bubbles: true, cancelable: true }));
}"""


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TakePage]:
    """Page on a take of 4 s, with a token."""
    take = write_take(tmp_path_factory.mktemp("takes") / "first.mcap", messages_of_track(moving(80, rate=20.0)))
    page = TakePage(take, PageTable(port=0, token="a-token-of-sixteen-letters"))
    page.open()
    yield page
    page.close()


@pytest.fixture(scope="module")
def page(shown: TakePage) -> Iterator["playwright.Page"]:
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        visited = browser.new_page(viewport=SIZE, color_scheme="light")
        problems: list[str] = []
        visited.on("pageerror", lambda error: problems.append(str(error)))
        visited.goto(shown.address)
        until(visited, lambda: visited.inner_text("#take-name") == "first", "the first take")
        yield visited
        assert problems == []
        browser.close()


def drop(page: "playwright.Page", name: str, content: bytes) -> None:
    page.evaluate(DROP, [name, base64.b64encode(content).decode()])


def test_what_is_no_take_is_one_line_and_the_page_goes_on(page: "playwright.Page", shown: TakePage) -> None:
    for name, content, text in (
        ("walk.mp4", b"video", "walk.mp4: is no take: allowed: a file whose name ends with .mcap"),
        ("walk.mcap", b"text", "walk.mcap: is no MCAP file: allowed: a take, recorded or made by zenocap track"),
        ("walk.mcap", b"\x89MCAP0\r\nabc", "walk.mcap: an MCAP file without messages of zenocap: allowed: a take"),
    ):
        drop(page, name, content)
        until(page, lambda text=text: page.inner_text("#open-text") == text, text)  # type: ignore[misc]
        assert page.is_hidden("#drop-target")
    assert shown.player.take == "first.mcap"
    assert page.inner_text("#take-name") == "first"


def test_a_take_is_shown_saved_for_download_only_and_left(page: "playwright.Page", shown: TakePage, tmp_path: Path) -> None:
    take = write_take(tmp_path / "other.mcap", messages_of_track(moving(160, rate=20.0)))
    drop(page, "second walk.mcap", take.read_bytes())
    until(page, lambda: page.inner_text("#take-name") == "second walk", "the dropped take")
    until(page, lambda: "/ 8.0 s" in page.inner_text("#clock"), "its duration")
    until(page, lambda: page.evaluate("zenocap.state.poses.size > 0"), "its poses")
    assert page.inner_text("#rig") == "take second walk"
    assert page.inner_text("#open-text") == "second walk.mcap is shown"
    page.select_option("#save-kind", "csv")
    assert save(page).startswith("ready as second walk.csv, only for download: 160 frames")
    assert page.is_visible("#saving-get")
    page.click("#stop")
    until(page, lambda: page.inner_text("#take-name") == "first", "the first take again")
    until(page, lambda: "/ 4.0 s" in page.inner_text("#clock"), "its duration")
    assert page.is_hidden("#stop")
    assert shown.player.take == "first.mcap"
    assert [path.name for path in shown._take.parent.iterdir()] == ["first.mcap"]


def test_a_file_is_chosen_by_keys(page: "playwright.Page", tmp_path: Path) -> None:
    take = write_take(tmp_path / "third.mcap", messages_of_track(moving(40, rate=20.0)))
    button = page.get_by_role("button", name="Open a take …", exact=True)
    page.click("#pause")  # Chromium without a graphics card draws nothing meanwhile
    until(page, lambda: page.get_attribute("#pause", "aria-label") == "play", "a pause")
    button.focus()
    asked = "(event) => { event.preventDefault(); window.asked = true; }"
    page.evaluate(f"document.getElementById('open-input').addEventListener('click', {asked}, {{ once: true }})")
    page.keyboard.press("Enter")
    until(page, lambda: page.evaluate("window.asked === true"), "the choice of a file")
    page.set_input_files("#open-input", take)
    until(page, lambda: page.inner_text("#take-name") == "third", "the chosen take")
    assert page.get_by_role("status").filter(has_text="third.mcap is shown").count() == 1
