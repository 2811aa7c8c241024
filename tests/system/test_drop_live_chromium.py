"""Dropping a take on the page of a live rig: the rig goes on and records, and the page shows so meanwhile."""

import re
import signal
from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.pose_tracks import moving
from tests.support.processes import output_of, recomputed_poses, started, wait_until
from tests.system.test_animator import rig_file
from tests.system.test_drop_chromium import drop
from tests.system.test_page_chromium import CHROMIUM, FLAGS, SIZE, playwright
from tests.system.test_show_chromium import until
from zenocap.tools.launcher.peer_mesh import free_ports

pytestmark = [pytest.mark.nightly, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")]
STARTING_S = 120.0  # of a rig beside Chromium without a graphics card


def recorded(page: "playwright.Page") -> int:
    """Messages in the take that the rig is recording, as the page shows them; -1 while it shows none."""
    found = re.fullmatch(r"recording: ([\d\u202f]+) messages so far", page.text_content("#recording-state") or "")
    return int(found[1].replace("\u202f", "")) if found else -1


def test_the_rig_records_while_a_dropped_take_is_shown_and_is_live_again(tmp_path: Path) -> None:
    (port,) = free_ports(1)
    dropped = write_take(tmp_path / "dropped.mcap", messages_of_track(moving(80, rate=20.0)))
    with started(["up", rig_file(tmp_path, port)], tmp_path) as process:
        wait_until(lambda: f"http://127.0.0.1:{port}" in output_of(tmp_path), tmp_path)
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            page = browser.new_page(viewport=SIZE)
            problems: list[str] = []
            page.on("pageerror", lambda error: problems.append(str(error)))
            page.goto(f"http://127.0.0.1:{port}/")
            until(page, lambda: page.evaluate("zenocap.state.poses.size > 0"), "a pose of the rig", STARTING_S)
            until(page, lambda: recorded(page) > 0, "the recording", STARTING_S)

            drop(page, "an old walk.mcap", dropped.read_bytes())
            until(page, lambda: page.inner_text("#take-name") == "an old walk", "the dropped take", STARTING_S)
            until(page, lambda: page.evaluate("zenocap.state.poses.size > 0"), "its poses", STARTING_S)
            assert page.inner_text("#feed") == "take"
            before = recorded(page)
            assert before > 0
            seen = [before]

            def goes_on() -> bool:
                """Whether a second and more of the rig was recorded; it is recording each time."""
                seen.append(recorded(page))
                assert page.text_content("#record") == "Stop recording"
                return seen[-1] > before + 100

            until(page, goes_on, "more of the rig in its take", STARTING_S)
            assert min(seen) >= before
            assert page.inner_text("#feed") == "take"

            page.click("#stop")
            until(page, lambda: page.inner_text("#feed") == "live", "the rig again", STARTING_S)
            until(page, lambda: page.evaluate("zenocap.state.poses.size > 0"), "a pose of the rig", STARTING_S)
            assert recorded(page) >= seen[-1]
            assert problems == []
            browser.close()
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0, output_of(tmp_path)
    assert "Traceback" not in output_of(tmp_path)
    (take,) = (tmp_path / "recordings").glob("*.mcap")
    assert recomputed_poses(take) > 5
