"""What a pose costs in every output, with a receiver that reads, and what a picture costs; CPU of the thread that sends."""

import socket
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from websockets.sync.client import connect

from common.body.anatomy import TEN_PARTS
from common.body.kinematics import part_frames
from common.conversion import angles_by_name, body_of
from common.messages import UniversalBap, UniversalBdp
from common.runtime.animator_table import FoxgloveTable, LslTable, UdpTable, VmcTable
from common.runtime.clock import RealClock
from services.animator.outputs.foxglove import FoxgloveOutput
from services.animator.outputs.lsl import LslOutput
from services.animator.outputs.udp import UdpOutput
from services.animator.outputs.vmc import VmcOutput
from services.animator.render.look import LOOKS
from services.animator.render.scene import Ground, Stage, sun_of
from services.animator.render.solids import posed, solids
from services.animator.render.viewpoint import looking
from tests.actors import BODIES, START_NS, stretched
from tests.foxglove_reader import in_envelope
from tests.test_output_foxglove import Panel, free_port

NAMES = list(BODIES)


@pytest.fixture
def port() -> Iterator[int]:
    """Of a receiver that reads and forgets."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        reading = threading.Thread(target=lambda: [None for _ in iter(lambda: listening.recv(65536), b"")], daemon=True)
        reading.start()
        number: int = listening.getsockname()[1]
        yield number
        listening.sendto(b"", ("127.0.0.1", number))
        reading.join(5)


@pytest.mark.parametrize("name", NAMES)
def test_vmc(benchmark: BenchmarkFixture, name: str, port: int) -> None:
    output, actor = VmcOutput(VmcTable(port=port)), stretched(name)
    benchmark(output.send, actor, None)
    assert output.counts()["sent"] > 1


@pytest.mark.parametrize("name", NAMES)
def test_udp(benchmark: BenchmarkFixture, name: str, port: int) -> None:
    output, actor = UdpOutput(UdpTable(port=port), "studio"), stretched(name)
    benchmark(output.send, actor, "wave")
    assert output.counts()["sent"] > 1


@pytest.mark.parametrize("name", NAMES)
def test_lsl(benchmark: BenchmarkFixture, name: str) -> None:
    pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'zenocap[lsl]'")
    output, actor = LslOutput(LslTable(stream="bench"), "studio", RealClock()), stretched(name)
    benchmark(output.send, actor, None)
    assert output.counts()["sent"] > 1
    output.close()


@pytest.mark.parametrize("looked_at", [False, True], ids=["nobody looks", "a client looks"])
def test_foxglove(benchmark: BenchmarkFixture, looked_at: bool) -> None:
    output = FoxgloveOutput(FoxgloveTable(port=free_port()), "studio")
    body = body_of(TEN_PARTS, BODIES["ten-parts"][1])
    output.hear(in_envelope(UniversalBdp(frame=0, captured_ns=START_NS, body=body, ratio=1.0)))
    actor = stretched("ten-parts")
    bap = in_envelope(
        UniversalBap(
            frame=1, captured_ns=START_NS, position=(0.0, 1.0, 0.0), scores={"1": 0.9, "2": 0.9}, stale=[], lost=[],
            angles=angles_by_name(TEN_PARTS, actor.pose.angles), views={"1": "facade", "2": "flank"},
        )
    )  # fmt: skip

    def once() -> None:
        output.hear(bap)
        output.send(actor, None)

    once()
    if looked_at:
        with connect(output.title.split()[1], subprotocols=["foxglove.sdk.v1"], max_size=None, close_timeout=0.2) as client:
            panel = Panel(client)
            panel.wait(output, "foxglove/studio/scene")
            benchmark(once)
            assert output.counts()["subscriptions"] > 0
    else:
        benchmark(once)
        assert output.counts()["subscriptions"] == 0
    output.close()


@pytest.mark.parametrize("size", [(640, 360), (1280, 720), (1920, 1080)], ids=["640x360", "1280x720", "1920x1080"])
def test_a_picture(benchmark: BenchmarkFixture, size: tuple[int, int]) -> None:
    actor = stretched("fourteen-parts")
    surface = posed(solids(actor.anatomy, actor.body), part_frames(actor.anatomy, actor.body, actor.pose))
    camera = looking(0.6, 0.25, surface.points, size)
    stage = Stage(camera, Ground(np.zeros(2), 4.0), LOOKS["light"], sun_of(0.6))
    image = benchmark(stage.picture, surface)
    assert image.shape == (size[1], size[0], 3)
