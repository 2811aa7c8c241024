"""A restarted viewer of a network camera takes up the kept background."""

import signal
from itertools import count
from pathlib import Path

import pytest

from tests.support.demo_rigs import written_rig
from tests.support.mjpeg_server import MjpegServer
from tests.support.processes import ended, output_of, started, wait_until
from tests.support.simulated_cameras import paper_cameras
from zenocap.simulation.body.person import person
from zenocap.simulation.rendering.camera import SimulatedCamera

pytestmark = pytest.mark.nightly
SIZE, FPS, SHOWN = (160, 120), 30.0, 450


def test_the_second_run_takes_up_the_background_of_the_first(tmp_path: Path) -> None:
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(SIZE), strict=True))
    room, shown = SimulatedCamera(cameras["cam01"], person(0), 0), count()
    images = [room.render(None, k) for k in range(20)]
    kept = tmp_path / "backgrounds" / "kept+0.npz"
    with MjpegServer(SIZE, FPS, picture=lambda: images[next(shown) % len(images)]) as server:
        head = "[zenoh]\nmulticast_scouting = false"
        written_rig(tmp_path, cameras, [server.url] * 2, name="kept", head=head, each="keep_background = true")
        for expected in (False, True):
            before = server.sent
            with started(["viewer", "rig.toml", "--id", "0"], tmp_path) as viewer:
                wait_until(lambda before=before: server.sent > before + SHOWN, tmp_path)  # type: ignore[misc]
                assert ended(viewer, signal.SIGINT) == 0, output_of(tmp_path)
            assert ("background of backgrounds/kept+0.npz taken up again" in output_of(tmp_path)) is expected
            assert kept.stat().st_mode & 0o777 == 0o600
    assert "not kept" not in output_of(tmp_path)
