"""Try live on the page of postures, in a real browser, on the poses of a rig that a replay publishes."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.posture_takes import NAMES, posture_take
from tests.system.test_posture_page_chromium import CHROMIUM, FLAGS, Visit, playwright
from tests.tools.posture_page.test_session import reader_of
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.rig.animator import PageTable
from zenocap.services.recognizer.model_file import find_model
from zenocap.tools.dataset.generate import dataset_rig
from zenocap.tools.launcher.peer_mesh import free_ports
from zenocap.tools.posture_page.live_trial import live_trial
from zenocap.tools.posture_page.manifest_file import ManifestFile
from zenocap.tools.posture_page.motion_view import open_motion
from zenocap.tools.posture_page.page import PosturePage
from zenocap.tools.posture_page.session import Publish, Session

pytestmark = [pytest.mark.system, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]


@contextmanager
def served(take: Path, manifest: Path, endpoint: str) -> Iterator[PosturePage]:
    """A page with a model that was trained earlier, and the rig of the take at an endpoint."""
    takes, file, ended = [open_motion(take)], ManifestFile(manifest), threading.Event()
    file.model.write_bytes(find_model("fifteen").read_bytes())
    options = ZenohOptions("peer", listen=(endpoint,), multicast_scouting=False)

    def session(publish: Publish) -> Session:
        live = live_trial(dataset_rig("truth"), options, lambda update: publish("live", update))
        return Session(takes, file, "anna", reader_of(manifest), publish, live=live)

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


def test_the_postures_of_a_running_rig_are_shown_on_the_page(tmp_path: Path) -> None:
    take = posture_take(tmp_path / "monday.mcap")
    endpoint = f"tcp/127.0.0.1:{free_ports(1)[0]}"
    with (
        playwright.sync_playwright() as driver,
        served(take, tmp_path / "examples.csv", endpoint) as page,
    ):
        visit = Visit(driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS), page)
        one = visit.page
        button = one.locator("#try-live")
        assert button.text_content() == "Try live on rig demo"
        button.click()
        visit.until(lambda: "no poses come from rig demo" in one.text_content("#live-text"), "no poses")
        command = [
            sys.executable, "-P", "-m", "zenocap", "replay", str(take), "--rate", "4", "--mode", "peer",
            "--connect", endpoint, "--no-multicast-scouting",
        ]  # fmt: skip
        replay = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            visit.until(lambda: one.text_content("#live-text") == "recognizing", "poses")
            visit.until(lambda: all(name in one.text_content("#live-counts") for name in NAMES), "every posture")
            assert one.locator("#live-now b").text_content() in NAMES
            assert "% confident" in one.text_content("#live-now span")
        finally:
            replay.terminate()
            replay.wait(20)
        button.click()
        visit.until(lambda: button.text_content() == "Try live on rig demo", "the end")
        assert one.text_content("#live-text") == ""
        visit.close()
