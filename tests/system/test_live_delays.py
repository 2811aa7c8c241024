"""A rig of which one camera is late: the delay is found while it runs, corrected, kept over a restart, and recomputed."""

import os
import re
import signal
import time
from pathlib import Path

import cv2
import pytest

from tests.support.processes import children_of, output_of, started, wait_until
from tests.support.walkers import SIZE, walker
from tests.system.test_tracker import last_line, poses_in, shows
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.messages import CameraDelays, Health
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.topics import CAMERA_DELAYS
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.verify.recompute import verify

pytestmark = pytest.mark.system
FPS, LATE_FRAMES, SECONDS = 15, 2, 110
FRAME_MS = 1e3 / FPS
KEPT_S = 5.0  # with the whole correction, in which poses go on
LONGEST_S = SECONDS - 10.0  # two estimates take 45 to 60 s of walking, the correction 8 s


def rig_with_a_late_camera(folder: Path) -> Path:
    """Rig file of two cameras, with films of a person who walks to and fro; the second one is two frames late."""
    one = walker(20, 2)
    write_calibration(folder / "calibration.toml", dict(one.cameras))
    poses = [one.motion.pose_at(k / FPS) for k in range(int(one.motion.duration_s * FPS))]
    there_and_back = [*range(len(poses)), *reversed(range(len(poses)))]
    tables = ['name = "late"\ncalibration = "calibration.toml"\nmethod = "hybrid"\ndelays = "follow"\n']
    for number, (name, camera) in enumerate(one.cameras.items(), 1):
        filming = SimulatedCamera(camera, one.person, 1)
        pictures = [filming.render(pose, k) for k, pose in enumerate(poses)]
        film = cv2.VideoWriter(str(folder / f"{name}.avi"), cv2.VideoWriter.fourcc(*"MJPG"), FPS, SIZE)
        late = LATE_FRAMES if number == 2 else 0
        for k in range(SECONDS * FPS):
            film.write(pictures[there_and_back[max(0, k - late) % len(there_and_back)]])
        film.release()
        cv2.imwrite(str(folder / f"{name}.png"), filming.background())
        tables.append(
            f'[[viewer]]\nid = "{number}"\ncamera = "{name}"\nsource = "{name}.avi"\n'
            f'background = "image:{name}.png"\nsize = [{SIZE[0]}, {SIZE[1]}]\nfps = {FPS}\n'
        )
    path = folder / "late.toml"
    path.write_text("\n".join(tables))
    return path


def test_a_late_camera_is_corrected_while_the_rig_runs_and_after_a_restart(tmp_path: Path) -> None:
    with started(["up", rig_with_a_late_camera(tmp_path), "--recordings", tmp_path], tmp_path) as process:
        wait_until(lambda: shows(tmp_path, r"tracker: [\d.]+/s tracking"), tmp_path)
        corrected = r"viewer 2 \d+ ms \([\d.]+ frames\) late, corrected by 1[123]\d"
        wait_until(lambda: re.search(corrected, output_of(tmp_path)) is not None, tmp_path, LONGEST_S)
        victims = [pid for pid, line in children_of(process.pid).items() if "zenocap integrator" in line]
        assert len(victims) == 1, children_of(process.pid)
        os.kill(victims[0], signal.SIGKILL)
        wait_until(lambda: "died (SIGKILL); starting it again" in output_of(tmp_path), tmp_path)
        wait_until(lambda: len(list(tmp_path.glob("late-*.mcap"))) == 2, tmp_path)
        wait_until(lambda: re.search(corrected, last_line(tmp_path)) is not None, tmp_path)
        time.sleep(KEPT_S)
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0, output_of(tmp_path)
    take, after_restart = sorted(tmp_path.glob("late-*.mcap"), key=lambda path: path.stat().st_ctime_ns)
    messages = [its.message for each in Take(take).messages() if (its := envelope(each)) is not None]
    delays = [message for message in messages if isinstance(message, CameraDelays)]
    assert delays[-1].found_ms == pytest.approx({"1": 0.0, "2": LATE_FRAMES * FRAME_MS}, abs=0.25 * FRAME_MS)
    assert delays[-1].applied_ms["2"] == pytest.approx(LATE_FRAMES * FRAME_MS, abs=0.3 * FRAME_MS)
    healths = [message for message in messages if isinstance(message, Health) and message.service == "integrator"]
    assert "corrected by" in healths[-1].state
    corrected_ns = next(one.captured_ns for one in delays if one.applied_ms == delays[-1].applied_ms)
    poses = [pose for pose in poses_in(after_restart) if tuple(pose.views) == ("1", "2")]
    assert poses[0].captured_ns > corrected_ns
    assert len(poses) > 0.4 * FPS * KEPT_S  # all of them on a machine without other load
    for path, fewest in ((take, len(delays) - 2), (after_restart, 1)):  # the trace of the last second is lost with a kill
        found = verify([path])
        assert found.first is None, found.first
        assert found.equal[CAMERA_DELAYS.at("late")] >= fewest
