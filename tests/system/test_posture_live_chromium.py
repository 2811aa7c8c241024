"""Try live on the page of postures, in a real browser, on the poses of a rig that a replay publishes."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.posture_takes import NAMES, posture_take
from tests.system.test_posture_page_chromium import CHROMIUM, FLAGS, Visit, playwright, served
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.services.recognizer.model_file import find_model
from zenocap.tools.dataset.generate import dataset_rig
from zenocap.tools.launcher.peer_mesh import free_ports
from zenocap.tools.posture_page.live_trial import LiveTrial, live_trial
from zenocap.tools.posture_page.manifest_file import ManifestFile
from zenocap.tools.posture_page.session import Publish

pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]


def test_the_postures_of_a_running_rig_are_shown_on_the_page(tmp_path: Path) -> None:
    take, manifest = posture_take(tmp_path / "monday.mcap"), tmp_path / "examples.csv"
    ManifestFile(manifest).model.write_bytes(find_model("fifteen").read_bytes())  # as if it was trained earlier
    endpoint = f"tcp/127.0.0.1:{free_ports(1)[0]}"
    options = ZenohOptions("peer", listen=(endpoint,), multicast_scouting=False)

    def live(publish: Publish) -> LiveTrial:
        return live_trial(dataset_rig("truth"), options, lambda update: publish("live", update))

    with playwright.sync_playwright() as driver, served(take, manifest, live) as page:
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
