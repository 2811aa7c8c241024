"""Rig with one late camera: delay found, corrected, kept over a restart, recomputed."""

import os
import re
import signal
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support import processes
from tests.support.mjpeg_server import MjpegServer
from tests.support.walkers import SIZE, Walker, walker
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import CameraDelays, Health, TrackerPose
from zenocap.common.recording.reader import TakeReader
from zenocap.common.topics import CAMERA_DELAYS, SILHOUETTE
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.takes.verify.recompute import verify

pytestmark = [pytest.mark.nightly, pytest.mark.alone]  # the delays of images in real time, which load changes
FPS, LATE_FRAMES, SECONDS = 15, 2, 110
VIEWS = 4
VIEWERS = tuple(str(number) for number in range(1, VIEWS + 1))
FRAME_MS = 1e3 / FPS
KNOWN_LATE_FRAMES = 3
KEPT = 5 * FPS  # frames with the whole correction, in which poses go on
LONGEST_S = SECONDS - 10.0  # two estimates take 45 to 60 s of walking, the correction 8 s


def seen_by(one: Walker, camera: Camera) -> tuple[list[np.ndarray], np.ndarray]:
    """Images of a camera while a person walks to and fro, to be repeated, and that of the empty room."""
    filming = SimulatedCamera(camera, one.person, 1)
    there = [filming.render(one.motion.pose_at(k / FPS), k) for k in range(int(one.motion.duration_s * FPS))]
    return there + there[::-1], filming.background()


def rig_file(folder: Path, one: Walker, head: str, viewer_lines: Mapping[str, str]) -> Path:
    """Rig file `late.toml` with a tracker; viewer_lines: source and other lines of the viewer of each camera."""
    write_calibration(folder / "calibration.toml", dict(one.cameras))
    tables = [f'name = "late"\ncalibration = "calibration.toml"\nmethod = "hybrid"\n{head}\n']
    for number, (camera, lines) in enumerate(viewer_lines.items(), 1):
        tables.append(
            f'[[viewer]]\nid = "{number}"\ncamera = "{camera}"\nbackground = "image:{camera}.png"\n'
            f"size = [{SIZE[0]}, {SIZE[1]}]\nfps = {FPS}\n{lines}\n"
        )
    path = folder / "late.toml"
    path.write_text("\n".join(tables))
    return path


def rig_with_a_late_camera(folder: Path) -> Path:
    """Rig file of cameras with films of a person who walks to and fro; the second one is two frames late."""
    one = walker(20, VIEWS)
    for number, (name, camera) in enumerate(one.cameras.items(), 1):
        pictures, room = seen_by(one, camera)
        film = cv2.VideoWriter(str(folder / f"{name}.avi"), cv2.VideoWriter.fourcc(*"MJPG"), FPS, SIZE)
        late = LATE_FRAMES if number == 2 else 0
        for k in range(SECONDS * FPS):
            film.write(pictures[max(0, k - late) % len(pictures)])
        film.release()
        cv2.imwrite(str(folder / f"{name}.png"), room)
    return rig_file(folder, one, 'delays = "follow"', {name: f'source = "{name}.avi"' for name in one.cameras})


def test_a_late_camera_is_corrected_while_the_rig_runs_and_after_a_restart(tmp_path: Path) -> None:
    with processes.started(["up", rig_with_a_late_camera(tmp_path), "--recordings", tmp_path], tmp_path) as process:
        processes.wait_until(lambda: processes.shows(tmp_path, r"tracker: [\d.]+/s tracking"), tmp_path)
        corrected = r"viewer 2 \d+ ms \([\d.]+ frames\) late, corrected by 1[123]\d"
        processes.wait_until(lambda: re.search(corrected, processes.output_of(tmp_path)) is not None, tmp_path, LONGEST_S)
        victims = [pid for pid, line in processes.children_of(process.pid).items() if "zenocap integrator" in line]
        assert len(victims) == 1, processes.children_of(process.pid)
        os.kill(victims[0], signal.SIGKILL)
        processes.wait_until(lambda: "died (SIGKILL); starting it again" in processes.output_of(tmp_path), tmp_path)
        processes.wait_until(lambda: len(list(tmp_path.glob("late-*.mcap"))) == 2, tmp_path)
        processes.wait_until(lambda: re.search(corrected, processes.last_line(tmp_path)) is not None, tmp_path)
        processes.wait_for_frames(tmp_path, KEPT)
        assert processes.ended(process, signal.SIGINT) == 3, processes.output_of(tmp_path)
    text = processes.output_of(tmp_path)
    assert "not counted: what integrator sent from" in text
    assert re.search(r"takes: [1-9]\d* lost, and an unknown number in", text) is not None, text
    take, after_restart = sorted(tmp_path.glob("late-*.mcap"), key=lambda path: path.stat().st_ctime_ns)
    messages = [its.message for its in TakeReader(take).envelopes()]
    delays = [message for message in messages if isinstance(message, CameraDelays)]
    late_ms = {viewer: LATE_FRAMES * FRAME_MS if viewer == "2" else 0.0 for viewer in VIEWERS}
    assert delays[-1].found_ms == pytest.approx(late_ms, abs=0.25 * FRAME_MS)
    assert delays[-1].applied_ms["2"] == pytest.approx(LATE_FRAMES * FRAME_MS, abs=0.3 * FRAME_MS)
    healths = [message for message in messages if isinstance(message, Health) and message.service == "integrator"]
    assert "corrected by" in healths[-1].state
    corrected_ns = next(one.captured_ns for one in delays if one.applied_ms == delays[-1].applied_ms)
    poses = [pose for pose in processes.messages_in(after_restart, TrackerPose) if tuple(pose.views) == VIEWERS]
    assert poses[0].captured_ns > corrected_ns
    assert len(poses) > 10  # all of them on a machine without other load
    found = verify([take])
    assert found.first is None, found.first
    assert found.equal[CAMERA_DELAYS.at("late")] >= len(delays) - 2  # the trace of the last second is lost with a kill
    # The integrator began with the second take, with its correction from before; the tracker did not: it is not recomputed.
    resumed = processes.messages_in(after_restart, CameraDelays)
    assert resumed[0].applied_ms["2"] == pytest.approx(LATE_FRAMES * FRAME_MS, abs=0.3 * FRAME_MS)
    found = verify([after_restart])
    assert not found.failed, found.first
    assert found.equal[CAMERA_DELAYS.at("late")] >= 1, found.reasons


def test_streams_of_known_delay_are_tracked_together(tmp_path: Path) -> None:
    """`delay_ms` of a camera that is three frames late: its images are used with those that the others took at the time."""
    one, late_s = walker(20, VIEWS), KNOWN_LATE_FRAMES / FPS
    with ExitStack() as servers:
        lines = {}
        for number, (name, camera) in enumerate(one.cameras.items(), 1):
            pictures, room = seen_by(one, camera)
            cv2.imwrite(str(tmp_path / f"{name}.png"), room)
            shown = partial(picture_now, pictures, late_s if number == 2 else 0.0)
            server = servers.enter_context(MjpegServer(SIZE, FPS, picture=shown))
            lines[name] = f'source = "{server.url}"' + (f"\ndelay_ms = {1e3 * late_s:.0f}" if number == 2 else "")
        path = rig_file(tmp_path, one, 'delays = "off"', lines)
        process = servers.enter_context(processes.started(["up", path, "--recordings", tmp_path], tmp_path))
        processes.wait_until(lambda: processes.shows(tmp_path, r"tracker: [\d.]+/s tracking"), tmp_path)
        processes.wait_for_frames(tmp_path, KEPT)
        assert processes.ended(process, signal.SIGINT) == 0, processes.output_of(tmp_path)
    (take,) = tmp_path.glob("late-*.mcap")
    whole = [pose for pose in processes.messages_in(take, TrackerPose) if tuple(pose.views) == VIEWERS]
    assert len(whole) > 10  # all of them on a machine without other load
    ages_s: dict[str, list[float]] = {viewer: [] for viewer in VIEWERS}
    for its in TakeReader(take).envelopes((SILHOUETTE,)):
        ages_s[its.message.viewer].append((its.received_ns - its.message.captured_ns) / 1e9)
    late, *others = (float(np.median(ages_s[viewer])) for viewer in ("2", "1", "3", "4"))
    assert late - max(others) == pytest.approx(late_s, abs=0.5 / FPS)
    assert verify([take]).first is None


def picture_now(pictures: Sequence[np.ndarray], late_s: float) -> np.ndarray:
    """What a camera sends now that shows what was there `late_s` ago."""
    return pictures[int((time.time() - late_s) * FPS) % len(pictures)]
