"""Processor time of the sending thread, for each output with a reading receiver, and per picture."""

import socket
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.services.animator.outputs.test_foxglove import Panel
from tests.support.foxglove_reader import in_envelope
from tests.support.ros_listener import session_at
from tests.support.virtual_actors import BODIES, START_NS, stretched
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import part_frames
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.messages import UniversalBap, UniversalBdp
from zenocap.common.rig.animator import FoxgloveTable, LslTable, RosTable, UdpTable, VmcTable, VrchatTable
from zenocap.common.runtime.clock import RealClock
from zenocap.services.animator.outputs.foxglove import FoxgloveOutput
from zenocap.services.animator.outputs.lsl import LslOutput
from zenocap.services.animator.outputs.output import Output
from zenocap.services.animator.outputs.ros import RosOutput
from zenocap.services.animator.outputs.udp import UdpOutput
from zenocap.services.animator.outputs.vmc import VmcOutput
from zenocap.services.animator.outputs.vrchat import VrchatOutput
from zenocap.tools.takes.render.camera_path import framing_camera
from zenocap.tools.takes.render.scene import Ground, Scene, sun_of
from zenocap.tools.takes.render.surfaces import body_surface, posed_surface
from zenocap.tools.takes.render.theme import THEMES

NAMES = list(BODIES)


@pytest.fixture
def port() -> Iterator[int]:
    """Port of a receiver that reads and discards."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        reading = threading.Thread(target=lambda: [None for _ in iter(lambda: listening.recv(65536), b"")], daemon=True)
        reading.start()
        number: int = listening.getsockname()[1]
        yield number
        listening.sendto(b"", ("127.0.0.1", number))
        reading.join(5)


OUTPUTS: dict[str, Callable[[int], Output]] = {
    "vmc": lambda port: VmcOutput(VmcTable(port=port)),
    "vrchat": lambda port: VrchatOutput(VrchatTable(port=port)),
    "udp": lambda port: UdpOutput(UdpTable(port=port), "studio"),
}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", OUTPUTS)
def test_datagrams(benchmark: BenchmarkFixture, kind: str, name: str, port: int) -> None:
    output, actor = OUTPUTS[kind](port), stretched(name)
    benchmark(output.send, actor, "wave")
    assert output.counts()["sent"] > 1


@pytest.mark.parametrize("name", NAMES)
def test_lsl(benchmark: BenchmarkFixture, name: str) -> None:
    pytest.importorskip("pylsl", reason="pylsl is not installed: the extra lsl")
    output, actor = LslOutput(LslTable(stream="bench"), "studio", RealClock()), stretched(name)
    benchmark(output.send, actor, None)
    assert output.counts()["sent"] > 1
    output.close()


@pytest.mark.parametrize("name", NAMES)
def test_ros(benchmark: BenchmarkFixture, name: str) -> None:
    endpoint = f"tcp/127.0.0.1:{free_ports(1)[0]}"
    with session_at(endpoint, "router") as router:
        router.declare_subscriber("0/**", lambda sample: None)  # not decoded: that would be the time of this process
        output, actor = RosOutput(RosTable(connect=endpoint), "studio", RealClock()), stretched(name)
        end_s = time.monotonic() + 20.0
        while not output.connected and time.monotonic() < end_s:
            time.sleep(0.01)
        benchmark(output.send, actor, None)
        assert output.counts()["sent"] > 1
        output.close()


@pytest.mark.parametrize("with_client", [False, True], ids=["no client", "one client"])
def test_foxglove(benchmark: BenchmarkFixture, with_client: bool) -> None:
    output = FoxgloveOutput(FoxgloveTable(port=free_ports(1)[0]), "studio")
    body = body_of(TEN_PARTS, BODIES["ten-parts"][1])
    output.receive(in_envelope(UniversalBdp(frame=0, captured_ns=START_NS, body=body, ratio=1.0)))
    actor = stretched("ten-parts")
    bap = in_envelope(
        UniversalBap(
            frame=1, captured_ns=START_NS, position=(0.0, 1.0, 0.0), scores={"1": 0.9, "2": 0.9}, stale=[], lost=[],
            angles=angles_by_name(TEN_PARTS, actor.pose.angles), views={"1": "facade", "2": "flank"},
        )
    )  # fmt: skip

    def send_pose() -> None:
        output.receive(bap)
        output.send(actor, None)

    send_pose()
    if with_client:
        with connect(
            output.title.split()[1], subprotocols=[Subprotocol("foxglove.sdk.v1")], max_size=None, close_timeout=0.2
        ) as client:
            panel = Panel(client)
            panel.wait(output, "foxglove/studio/scene")
            benchmark(send_pose)
            assert output.counts()["subscriptions"] > 0
    else:
        benchmark(send_pose)
        assert output.counts()["subscriptions"] == 0
    output.close()


@pytest.mark.parametrize("size", [(640, 360), (1280, 720), (1920, 1080)], ids=["640x360", "1280x720", "1920x1080"])
def test_render_a_picture(benchmark: BenchmarkFixture, size: tuple[int, int]) -> None:
    actor = stretched("fourteen-parts")
    surface = posed_surface(body_surface(actor.anatomy, actor.body), part_frames(actor.anatomy, actor.body, actor.pose))
    camera = framing_camera(0.6, 0.25, surface.points, size)
    scene = Scene(camera, Ground(np.zeros(2), 4.0), THEMES["light"], sun_of(0.6))
    image = benchmark(scene.picture, surface)
    assert image.shape == (size[1], size[0], 3)
