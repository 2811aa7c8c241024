"""Advice about a dark camera, from its viewer to the page and to `doctor`."""

import asyncio
import json
from contextlib import ExitStack
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from tests.support.demo_rigs import written_rig
from tests.support.mjpeg_server import MjpegServer
from tests.support.networks import free_endpoint
from tests.support.page_client import connected
from tests.support.processes import PATIENCE_S, completed, output_of, started
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.simulation.body.person import person
from zenocap.simulation.rendering.camera import SimulatedCamera

pytestmark = pytest.mark.nightly
SIZE, FPS = (160, 120), 20.0
LIGHT = {"0": 0.15, "1": 1.0}  # by viewer, of the room as it is rendered


async def advice_of_page(port: int) -> dict[str, list[str]]:
    """Codes of the faults by viewer, once the page has advice of both."""
    found: dict[str, list[str]] = {}
    async with await connected(port) as connection:
        while len(found) < len(LIGHT) or not found["0"]:
            for update in json.loads(await connection.recv()):
                if update["type"] == "advice":
                    found[update["viewer"]] = [line["code"] for line in update["lines"]]
            await connection.send('{"type":"acknowledge"}')
    return found


def test_the_page_and_doctor_name_the_dark_camera_and_not_the_other(tmp_path: Path) -> None:
    cameras = dict(zip(("cam01", "cam02"), paper_cameras(SIZE), strict=True))
    (page,), endpoint = free_ports(1), free_endpoint()
    with ExitStack() as stack:
        urls = []
        for camera, level in zip(cameras.values(), LIGHT.values(), strict=True):
            room = SimulatedCamera(camera, person(0), 0)
            images = cycle([np.asarray(room.render(None, k) * level, dtype=np.uint8) for k in range(20)])
            urls.append(stack.enter_context(MjpegServer(SIZE, FPS, picture=partial(next, images))).url)
        head = f"[zenoh]\nmulticast_scouting = false\n[animator.page]\nport = {page}\n"
        written_rig(tmp_path, cameras, urls, name="advised", head=head)
        for command in (
            ("animator", "rig.toml", "-l", endpoint), *(("viewer", "rig.toml", "--id", id, "-e", endpoint) for id in LIGHT)
        ):  # fmt: skip
            stack.enter_context(started(command, tmp_path))
        try:
            found = asyncio.run(asyncio.wait_for(advice_of_page(page), PATIENCE_S))
        except TimeoutError:
            raise AssertionError(output_of(tmp_path)) from None
        doctor = completed(["doctor", "rig.toml", "--json", "-e", endpoint], tmp_path)
    assert found == {"0": ["dark"], "1": []}
    images = {one["check"]: one for one in json.loads(doctor.stdout)["findings"] if one["check"].startswith("images of")}
    assert images["images of viewer 0"]["verdict"] == "warning"
    assert images["images of viewer 0"]["words"].startswith("the image is dark: mean level ")
    assert images["images of viewer 0"]["remedy"] == "add light, or open the aperture"
    assert images["images of viewer 1"]["verdict"] == "ok"
    assert "while a person is in view" in images["images of viewer 1"]["words"]  # of an empty room nothing is stated
