"""Advice about a dark camera, from its viewer to the page and to `doctor`."""

import asyncio
import json
import subprocess
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect

from tests.support.mjpeg_server import MjpegServer
from tests.support.processes import ENVIRONMENT, PATIENCE_S, ZENOCAP, output_of, started
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.simulation.body.person import person
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.record.launcher.peer_mesh import free_ports

pytestmark = pytest.mark.nightly
SIZE, FPS = (160, 120), 20.0
LIGHT = {"0": 0.15, "1": 1.0}  # by viewer, of the room as it is rendered


async def advice_of_page(port: int) -> dict[str, list[str]]:
    """Codes of the faults by viewer, once the page has advice of both."""
    found: dict[str, list[str]] = {}
    while True:
        try:
            connection = await connect(f"ws://127.0.0.1:{port}/socket", compression=None)
            break
        except OSError:
            await asyncio.sleep(0.1)
    async with connection:
        while len(found) < len(LIGHT) or not found["0"]:
            for update in json.loads(await connection.recv()):
                if update["type"] == "advice":
                    found[update["viewer"]] = [line["code"] for line in update["lines"]]
            await connection.send('{"type":"acknowledge"}')
    return found


def test_the_page_and_doctor_name_the_dark_camera_and_not_the_other(tmp_path: Path) -> None:
    cameras = dict(zip(LIGHT, paper_cameras(SIZE), strict=True))
    write_calibration(tmp_path / "calibration.toml", {f"cam0{int(id) + 1}": camera for id, camera in cameras.items()})
    films = {}
    for id, camera in cameras.items():
        room = SimulatedCamera(camera, person(0), 0)
        films[id] = [np.asarray(room.render(None, k) * LIGHT[id], dtype=np.uint8) for k in range(20)]
    shown = {id: count() for id in LIGHT}
    zenoh, page = free_ports(2)
    with (
        MjpegServer(SIZE, FPS, picture=lambda: films["0"][next(shown["0"]) % 20]) as dark,
        MjpegServer(SIZE, FPS, picture=lambda: films["1"][next(shown["1"]) % 20]) as bright,
    ):
        text = 'name = "advised"\ncalibration = "calibration.toml"\n[zenoh]\nmulticast_scouting = false\n'
        text += f"[animator.page]\nport = {page}\n"
        for id, server in (("0", dark), ("1", bright)):
            text += f'[[viewer]]\nid = "{id}"\ncamera = "cam0{int(id) + 1}"\nsource = "{server.url}"\n'
        (tmp_path / "rig.toml").write_text(text)
        near, far = ["-l", f"tcp/127.0.0.1:{zenoh}"], ["-e", f"tcp/127.0.0.1:{zenoh}"]
        with (
            started(["animator", "rig.toml", *near], tmp_path),
            started(["viewer", "rig.toml", "--id", "0", *far], tmp_path),
            started(["viewer", "rig.toml", "--id", "1", *far], tmp_path),
        ):
            try:
                found = asyncio.run(asyncio.wait_for(advice_of_page(page), PATIENCE_S))
            except TimeoutError:
                raise AssertionError(output_of(tmp_path)) from None
            doctor = subprocess.run(
                [*ZENOCAP, "doctor", "rig.toml", "--json", *far], cwd=tmp_path, env=ENVIRONMENT, capture_output=True,
                text=True, timeout=PATIENCE_S, check=False,
            )  # fmt: skip
    assert found == {"0": ["dark"], "1": []}
    images = {one["check"]: one for one in json.loads(doctor.stdout)["findings"] if one["check"].startswith("images of")}
    assert images["images of viewer 0"]["verdict"] == "warning"
    assert images["images of viewer 0"]["words"].startswith("the image is dark: mean level ")
    assert images["images of viewer 0"]["remedy"] == "add light, or open the aperture"
    assert images["images of viewer 1"]["verdict"] == "ok"
    assert "while a person is in view" in images["images of viewer 1"]["words"]  # of an empty room nothing is stated
