"""The tracker as processes: three cameras around the simulated person, one of which is killed and restarted."""

import os
import re
import signal
from pathlib import Path

import pytest

from tests.support.processes import children_of, ended, output_of, started, wait_until
from zenocap.common.messages import TrackerPose
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.topics import TRACKER_POSE
from zenocap.tools.verify.recompute import verify

pytestmark = pytest.mark.core
RIG = demo_rig_file("two-view").with_name("ring.toml")


def three_cameras(folder: Path) -> Path:
    """The ring rig with its first three viewers."""
    head, *viewers = RIG.read_text().split("[[viewer]]")
    calibration = RIG.with_name("ring-calibration.toml")
    (folder / calibration.name).write_text(calibration.read_text())
    (folder / "ring.toml").write_text("[[viewer]]".join([head, *viewers[:3]]))
    return folder / "ring.toml"


def last_line(folder: Path) -> str:
    """The last complete line of the display."""
    (path,) = folder.glob("up*.out")
    lines = [line for line in path.read_text().splitlines(keepends=True) if line.endswith("\n") and " s | " in line]
    return lines[-1] if lines else ""


def shows(folder: Path, pattern: str) -> bool:
    return re.search(pattern, last_line(folder)) is not None


def frame_of(folder: Path) -> int:
    """Frame number in the last line of the display."""
    found = re.search(r"frame (\d+)", last_line(folder))
    return int(found[1]) if found else 0


def wait_for_frames(folder: Path, count: int) -> None:
    """Wait until the display has gone on by some frames."""
    first = frame_of(folder)
    wait_until(lambda: frame_of(folder) > first + count, folder)


def poses_in(take: Path) -> list[TrackerPose]:
    read = Take(take)
    found = [received.message for each in read.messages() if (received := envelope(each)) is not None]
    assert read.cut is None
    return [message for message in found if isinstance(message, TrackerPose)]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds children in /proc")
def test_tracking_continues_without_a_killed_viewer_and_uses_it_again(tmp_path: Path) -> None:
    rig = three_cameras(tmp_path)
    with started(["up", rig, "--recordings", tmp_path], tmp_path) as process:
        wait_until(lambda: shows(tmp_path, r"viewer 3: [\d.]+/s used.* tracker: [\d.]+/s tracking "), tmp_path)
        victims = [pid for pid, line in children_of(process.pid).items() if "viewer" in line and "--id 3" in line]
        assert len(victims) == 1
        os.kill(victims[0], signal.SIGKILL)
        wait_until(lambda: "starting it again" in output_of(tmp_path), tmp_path)
        wait_until(lambda: "without viewer 3" in last_line(tmp_path), tmp_path)
        wait_until(lambda: shows(tmp_path, r"viewer 3: [\d.]+/s used"), tmp_path)
        children = children_of(process.pid)
        assert ended(process, signal.SIGINT) == 0, output_of(tmp_path)
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    text = output_of(tmp_path)
    assert "Traceback" not in text
    assert "died (SIGKILL); starting it again" in text
    (take,) = tmp_path.glob("ring-*.mcap")
    views = [tuple(pose.views) for pose in poses_in(take)]
    first = views.index(("1", "2", "3"))  # poses before it may lack a view that was still starting
    assert ("1", "2") in views[first:]
    assert ("1", "2", "3") in views[views.index(("1", "2"), first) :]
    found = verify([take])
    assert found.first is None, found.first
    assert found.equal[TRACKER_POSE.at("ring")] == len(views)
