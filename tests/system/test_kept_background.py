"""A restarted viewer of a network camera takes up the kept background."""

import signal
from itertools import count
from pathlib import Path

import pytest

from tests.support.mjpeg_server import MjpegServer
from tests.support.processes import ended, output_of, started, wait_until
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.simulation.body.person import person
from zenocap.simulation.rendering.camera import SimulatedCamera

pytestmark = pytest.mark.nightly
SIZE, FPS, SHOWN = (160, 120), 30.0, 450


def test_the_second_run_takes_up_the_background_of_the_first(tmp_path: Path) -> None:
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(SIZE), strict=True))
    write_calibration(tmp_path / "calibration.toml", cameras)
    room, shown = SimulatedCamera(cameras["cam01"], person(0), 0), count()
    images = [room.render(None, k) for k in range(20)]
    kept = tmp_path / "backgrounds" / "kept+0.npz"
    with MjpegServer(SIZE, FPS, picture=lambda: images[next(shown) % len(images)]) as server:
        text = 'name = "kept"\ncalibration = "calibration.toml"\n[zenoh]\nmulticast_scouting = false\n'
        for number, name in enumerate(cameras):
            text += f'[[viewer]]\nid = "{number}"\ncamera = "{name}"\nsource = "{server.url}"\nkeep_background = true\n'
        (tmp_path / "rig.toml").write_text(text)
        for expected in (False, True):
            before = server.sent
            with started(["viewer", "rig.toml", "--id", "0"], tmp_path) as viewer:
                wait_until(lambda before=before: server.sent > before + SHOWN, tmp_path)  # type: ignore[misc]
                assert ended(viewer, signal.SIGINT) == 0, output_of(tmp_path)
            assert ("background of backgrounds/kept+0.npz taken up again" in output_of(tmp_path)) is expected
            assert kept.stat().st_mode & 0o777 == 0o600
    assert "not kept" not in output_of(tmp_path)
