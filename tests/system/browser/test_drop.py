"""Take dropped on the page of another take or of a live rig."""

import base64
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.browser import PATIENCE_S, Visit, visited
from tests.support.pose_tracks import moving
from tests.support.processes import output_of, recomputed_poses, started, wait_until
from tests.system.browser.test_save import save
from tests.system.test_animator import rig_file
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.show import TakePage

pytestmark = pytest.mark.core
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


@pytest.fixture
def visit(browser: object, shown: TakePage) -> Iterator[Visit]:
    with visited(browser, shown.address, scheme="light") as one:
        one.until(lambda: one.text("#take-name") == "first", "the first take")
        yield one


def drop(visit: Visit, name: str, content: bytes) -> None:
    visit.page.evaluate(DROP, [name, base64.b64encode(content).decode()])


def test_what_is_no_take_is_one_line_and_the_page_goes_on(visit: Visit, shown: TakePage) -> None:
    for name, content, text in (
        ("walk.mp4", b"video", "walk.mp4: is no take: allowed: a file whose name ends with .mcap"),
        ("walk.mcap", b"text", "walk.mcap: is no MCAP file: allowed: a take, recorded or made by zenocap track"),
        ("walk.mcap", b"\x89MCAP0\r\nabc", "walk.mcap: an MCAP file without messages of zenocap: allowed: a take"),
    ):
        drop(visit, name, content)
        visit.until(lambda text=text: visit.text("#open-text") == text, text)
        assert visit.page.is_hidden("#drop-target")
    assert shown.player.take == "first.mcap"
    assert visit.text("#take-name") == "first"


@pytest.mark.nightly
def test_a_take_is_shown_saved_for_download_only_and_left(visit: Visit, shown: TakePage, tmp_path: Path) -> None:
    take = write_take(tmp_path / "other.mcap", messages_of_track(moving(160, rate=20.0)))
    drop(visit, "second walk.mcap", take.read_bytes())
    visit.until(lambda: visit.text("#take-name") == "second walk", "the dropped take")
    visit.until(lambda: "/ 8.0 s" in visit.text("#clock"), "its duration")
    visit.until(lambda: visit.evaluate("zenocap.state.poses.size > 0"), "its poses")
    assert visit.text("#rig") == "take second walk"
    assert visit.text("#open-text") == "second walk.mcap is shown"
    visit.page.select_option("#save-kind", "csv")
    assert save(visit).startswith("ready as second walk.csv, only for download: 160 frames")
    assert visit.page.is_visible("#saving-get")
    visit.page.click("#stop")
    visit.until(lambda: visit.text("#take-name") == "first", "the first take again")
    visit.until(lambda: "/ 4.0 s" in visit.text("#clock"), "its duration")
    assert visit.page.is_hidden("#stop")
    assert shown.player.take == "first.mcap"
    assert [path.name for path in shown._take.parent.iterdir()] == ["first.mcap"]


@pytest.mark.nightly
def test_a_file_is_chosen_by_keys(visit: Visit, tmp_path: Path) -> None:
    take = write_take(tmp_path / "third.mcap", messages_of_track(moving(40, rate=20.0)))
    page = visit.page
    button = page.get_by_role("button", name="Open a take …", exact=True)
    page.click("#pause")  # Chromium without a graphics card draws nothing meanwhile
    visit.until(lambda: page.get_attribute("#pause", "aria-label") == "play", "a pause")
    button.focus()
    asked = "(event) => { event.preventDefault(); window.asked = true; }"
    page.evaluate(f"document.getElementById('open-input').addEventListener('click', {asked}, {{ once: true }})")
    page.keyboard.press("Enter")
    visit.until(lambda: visit.evaluate("window.asked === true"), "the choice of a file")
    page.set_input_files("#open-input", take)
    visit.until(lambda: visit.text("#take-name") == "third", "the chosen take")
    assert page.get_by_role("status").filter(has_text="third.mcap is shown").count() == 1


def recorded(visit: Visit) -> int:
    """Messages in the take that the rig is recording, as the page shows them; -1 while it shows none."""
    found = re.fullmatch(r"recording: ([\d\u202f]+) messages so far", visit.page.text_content("#recording-state") or "")
    return int(found[1].replace("\u202f", "")) if found else -1


@pytest.mark.nightly
def test_the_rig_records_while_a_dropped_take_is_shown_and_is_live_again(browser: object, tmp_path: Path) -> None:
    (port,) = free_ports(1)
    dropped = write_take(tmp_path / "dropped.mcap", messages_of_track(moving(80, rate=20.0)))
    with started(["up", rig_file(tmp_path, port)], tmp_path) as process:
        wait_until(lambda: f"http://127.0.0.1:{port}" in output_of(tmp_path), tmp_path, PATIENCE_S)
        with visited(browser, f"http://127.0.0.1:{port}/") as visit:
            visit.until(lambda: visit.evaluate("zenocap.state.poses.size > 0"), "a pose of the rig")
            visit.until(lambda: recorded(visit) > 0, "the recording")

            drop(visit, "an old walk.mcap", dropped.read_bytes())
            visit.until(lambda: visit.text("#take-name") == "an old walk", "the dropped take")
            visit.until(lambda: visit.evaluate("zenocap.state.poses.size > 0"), "its poses")
            assert visit.text("#feed") == "take"
            before = recorded(visit)
            assert before > 0
            seen = [before]

            def goes_on() -> bool:
                """Whether a second and more of the rig was recorded; it is recording each time."""
                seen.append(recorded(visit))
                assert visit.page.text_content("#record") == "Stop recording"
                return seen[-1] > before + 100

            visit.until(goes_on, "more of the rig in its take")
            assert min(seen) >= before
            assert visit.text("#feed") == "take"

            visit.page.click("#stop")
            visit.until(lambda: visit.text("#feed") == "live", "the rig again")
            visit.until(lambda: visit.evaluate("zenocap.state.poses.size > 0"), "a pose of the rig")
            assert recorded(visit) >= seen[-1]
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0, output_of(tmp_path)
    assert "Traceback" not in output_of(tmp_path)
    (take,) = (tmp_path / "recordings").glob("*.mcap")
    assert recomputed_poses(take) > 5
