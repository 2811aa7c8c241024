"""The Foxglove WebSocket with a client of the plain websockets library, read by the schemas that the server sends."""

import json
import socket
import struct
from base64 import b64decode
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest
from websockets.sync.client import ClientConnection, connect

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.body.kinematics import part_frames
from common.bus.protocol import Envelope
from common.conversion import angles_by_name, body_of
from common.runtime.animator_table import FoxgloveTable
from common.take.recording import Channel
from services.animator.outputs.foxglove import FoxgloveOutput
from services.animator.outputs.output import OutputError
from tests.actors import BODIES, START_NS, posed, stretched
from tests.foxglove_reader import in_envelope, parsed, xyz

CAMERA = m.CameraInfo(
    frame=0, captured_ns=START_NS, viewer="1", name="cam01", size=(160, 120),
    matrix=[150, 0, 79.5, 0, 150, 59.5, 0, 0, 1], distortions=[], rotation=[1, 0, 0, 0, -1, 0, 0, 0, -1],
    translation=[0, 1, 3],
)  # fmt: skip
BODY = in_envelope(
    m.UniversalBdp(frame=0, captured_ns=START_NS, body=body_of(TEN_PARTS, BODIES["ten-parts"][1]), ratio=1.0)
)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


def bap(frame: int, shares: float = 0.4, lost: tuple[str, ...] = ()) -> Envelope:
    pose = posed("ten-parts", np.full(25, shares), np.array([0.3, 0.9, -0.2])).pose
    x, y, z = pose.position.tolist()
    message = m.UniversalBap(
        frame=frame, captured_ns=START_NS + frame, position=(x, y, z), angles=angles_by_name(TEN_PARTS, pose.angles),
        scores={"1": 0.9}, views={"1": "facade"}, stale=[], lost=list(lost),
    )  # fmt: skip
    return in_envelope(message, received_ns=START_NS + frame)


@dataclass
class Panel:
    """One client: subscribes to all channels that are advertised, and keeps the last message of each topic."""

    socket: ClientConnection
    channels: dict[int, Channel] = field(default_factory=dict)
    said: dict[str, bytes] = field(default_factory=dict)

    def wait(self, output: FoxgloveOutput, *topics: str) -> None:
        """Poses go on, as they do live, until each of the topics has said something."""
        for frame in range(1, 500):
            output.hear(bap(frame))
            self.read(0.01)
            if set(topics) <= set(self.said):
                return
        raise AssertionError(f"not said: {set(topics) - set(self.said)}")

    def read(self, seconds: float) -> None:
        """What comes until nothing does for so long."""
        while True:
            try:
                data = self.socket.recv(timeout=seconds)
            except TimeoutError:
                return
            if isinstance(data, str):
                self._told(json.loads(data))
            elif data[0] == 1:  # a message: its subscription and log time before it
                (subscription,) = struct.unpack_from("<I", data, 1)
                self.said[self.channels[subscription].topic] = data[13:]

    def _told(self, told: dict[str, object]) -> None:
        if told["op"] != "advertise":
            return
        new = []
        for one in told["channels"]:
            schema = b64decode(one["schema"]) if one["schemaEncoding"] == "protobuf" else one["schema"].encode()
            channel = Channel(one["topic"], one["encoding"], one["schemaName"], one["schemaEncoding"], schema)
            self.channels[one["id"]] = channel
            new.append({"id": one["id"], "channelId": one["id"]})
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": new}))

    def last(self, topic: str):
        channel = next(channel for channel in self.channels.values() if channel.topic == topic)
        data = self.said[topic]
        return json.loads(data) if channel.encoding == "json" else parsed(channel, data)


@pytest.fixture
def output() -> Iterator[FoxgloveOutput]:
    one = FoxgloveOutput(FoxgloveTable(port=free_port()), "studio")
    yield one
    one.close()


@pytest.fixture
def panel(output: FoxgloveOutput) -> Iterator[Panel]:
    with connected(output) as socket:
        yield Panel(socket)


def connected(output: FoxgloveOutput) -> ClientConnection:
    return connect(output.title.split()[1], subprotocols=["foxglove.sdk.v1"], max_size=None, close_timeout=0.2)


def test_a_client_gets_the_body_where_kinematics_put_it(output: FoxgloveOutput, panel: Panel) -> None:
    output.hear(BODY)
    panel.wait(output, "foxglove/studio/scene", "foxglove/studio/body", "foxglove/studio/pose")
    (entity,) = panel.last("foxglove/studio/scene").entities
    actor = posed("ten-parts", np.full(25, 0.4), np.array([0.3, 0.9, -0.2]))
    frames = part_frames(actor.anatomy, actor.body, actor.pose)
    assert len(entity.cylinders) == 10
    for k, cylinder in enumerate(entity.cylinders):
        middle = frames[k, :, 3] + actor.body.sizes[k, 0] / 2 * frames[k, :, 1]
        np.testing.assert_allclose(xyz(cylinder.pose.position), middle, atol=1e-9)
    assert panel.last("foxglove/studio/pose")["tracked"] is True


def test_who_comes_late_gets_what_is_said_once(output: FoxgloveOutput, panel: Panel) -> None:
    output.hear(in_envelope(CAMERA, received_ns=START_NS))
    output.hear(BODY)
    panel.wait(output, "foxglove/studio/viewer/1/calibration", "foxglove/studio/fixed")
    with connected(output) as socket:
        late = Panel(socket)
        late.wait(output, "foxglove/studio/viewer/1/calibration", "foxglove/studio/fixed", "foxglove/studio/scene")
        assert late.last("foxglove/studio/viewer/1/calibration").width == 160


def test_while_nobody_looks_every_channel_is_known_and_nothing_is_made(output: FoxgloveOutput) -> None:
    output.hear(BODY)
    for frame in range(50):
        output.hear(bap(frame))
    alone = output.counts()
    assert alone["subscriptions"] == 0
    assert alone["sent"] < 10
    with connected(output) as socket:
        panel = Panel(socket)
        panel.read(0.2)
        assert {"scene", "body", "joints", "pose", "fixed"} <= {c.topic.split("/")[-1] for c in panel.channels.values()}


def test_of_two_sources_the_one_that_is_shown_is_sent(output: FoxgloveOutput, panel: Panel) -> None:
    output.hear(BODY)
    output.send(stretched("fourteen-parts"), None)  # the tracker's
    for frame in range(5):
        output.hear(bap(frame))
    panel.read(0.1)
    assert panel.said.keys() <= {"foxglove/studio/fixed"}
    output.send(stretched("ten-parts"), None)
    output.hear(BODY)
    panel.wait(output, "foxglove/studio/scene")


def test_a_client_that_never_reads_loses_frames_of_its_own(output: FoxgloveOutput, panel: Panel) -> None:
    output.hear(BODY)
    panel.wait(output, "foxglove/studio/scene")
    for frame in range(3000):  # nobody reads meanwhile; the queue of that client keeps the newest
        output.hear(bap(frame, shares=frame / 3000))
    with connected(output) as socket:
        other = Panel(socket)
        other.wait(output, "foxglove/studio/scene")


def test_a_damaged_message_is_counted_and_the_next_one_shown(output: FoxgloveOutput, panel: Panel) -> None:
    output.hear(BODY)
    panel.wait(output, "foxglove/studio/scene")
    bad = m.Silhouette(frame=0, captured_ns=1, viewer="1", size=(8, 8), region=(0, 0, 8, 8), data=b"\x01none")
    output.hear(in_envelope(bad))
    assert output.counts()["failed"] == 1
    panel.said.clear()
    panel.wait(output, "foxglove/studio/scene")


def test_a_port_in_use_and_a_bad_address_are_told_in_one_line(output: FoxgloveOutput) -> None:
    port = int(output.title.rpartition(":")[2])
    with pytest.raises(
        OutputError, match=rf"^animator\.foxglove: 127\.0\.0\.1:{port} cannot be listened on: Address already"
    ):
        FoxgloveOutput(FoxgloveTable(port=port), "studio")
    with pytest.raises(OutputError, match=r"no\.such\.host\.invalid:8765 cannot be listened on: failed to lookup"):
        FoxgloveOutput(FoxgloveTable(host="no.such.host.invalid"), "studio")
