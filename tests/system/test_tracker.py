"""Tracker as processes: three cameras; one is killed and restarted."""

import os
import re
import signal
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.session_rigs import SessionRig, three_cameras
from zenocap.common.messages import TrackerPose
from zenocap.common.topics import TRACKER_POSE

pytestmark = pytest.mark.core


def test_a_ring_of_cameras_is_tracked_and_its_take_verifies(ring_rig: SessionRig, ring_take: Path) -> None:
    poses = processes.messages_in(ring_take, TrackerPose)
    assert len(poses) > 20  # all of the frames on a machine without other load
    assert ("1", "2", "3") in [tuple(pose.views) for pose in poses]
    found = processes.verified(ring_take)
    assert found.equal[TRACKER_POSE.at("ring")] == len(poses)
    text = processes.output_of(ring_rig.folder)
    assert re.search(r"viewer 3: [\d.]+/s used", text)
    assert "Traceback" not in text


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds children in /proc")
def test_tracking_continues_without_a_killed_viewer_and_uses_it_again(tmp_path: Path) -> None:
    rig = three_cameras(tmp_path)
    with processes.started(["up", rig, "--recordings", tmp_path], tmp_path) as process:
        processes.wait_until(
            lambda: processes.shows(tmp_path, r"viewer 3: [\d.]+/s used.* tracker: [\d.]+/s tracking "), tmp_path
        )
        victims = [pid for pid, line in processes.children_of(process.pid).items() if "viewer" in line and "--id 3" in line]
        assert len(victims) == 1
        os.kill(victims[0], signal.SIGKILL)
        processes.wait_until(lambda: "starting it again" in processes.output_of(tmp_path), tmp_path)
        processes.wait_until(lambda: "without viewer 3" in processes.last_line(tmp_path), tmp_path)
        processes.wait_until(lambda: processes.shows(tmp_path, r"viewer 3: [\d.]+/s used"), tmp_path)
        children = processes.children_of(process.pid)
        assert processes.ended(process, signal.SIGINT) == 3, processes.output_of(
            tmp_path
        )  # what the killed one sent last is in no count
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    text = processes.output_of(tmp_path)
    assert "not counted: what viewer 3 sent from" in text
    assert "Traceback" not in text
    assert "died (SIGKILL); starting it again" in text
    (take,) = tmp_path.glob("ring-*.mcap")
    views = [tuple(pose.views) for pose in processes.messages_in(take, TrackerPose)]
    first = views.index(("1", "2", "3"))  # poses before it may lack a view that was still starting
    assert ("1", "2") in views[first:]
    assert ("1", "2", "3") in views[views.index(("1", "2"), first) :]
    assert processes.verified(take).equal[TRACKER_POSE.at("ring")] == len(views)
