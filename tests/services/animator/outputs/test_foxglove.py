"""Foxglove output, decoded by a plain websockets client from the server's schemas."""

import json
import socket
import struct
from base64 import b64decode
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from msgspec import structs
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tests.support.built_messages import built
from tests.support.foxglove_reader import in_envelope, parsed, xyz
from tests.support.virtual_actors import BODIES, START_NS, posed, stretched
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import part_frames
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.recording.channel_limits import MAX_UNKNOWN_KEYS
from zenocap.common.recording.writer import Channel
from zenocap.common.rig.animator import FoxgloveTable
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.animator.outputs.foxglove import FoxgloveOutput
from zenocap.services.animator.outputs.output import OutputError
from zenocap.services.animator.outputs.output_group import OutputGroup
from zenocap.services.animator.page_bridge import PageBridge

CAMERA = built(
    m.CameraInfo, captured_ns=START_NS, matrix=[150, 0, 79.5, 0, 150, 59.5, 0, 0, 1],
    rotation=[1, 0, 0, 0, -1, 0, 0, 0, -1], translation=[0, 1, 3],
)  # fmt: skip
BODY = in_envelope(
    m.UniversalBdp(frame=0, captured_ns=START_NS, body=body_of(TEN_PARTS, BODIES["ten-parts"][1]), ratio=1.0)
)
ACTOR = posed("ten-parts", np.full(25, 0.4), np.array([0.3, 0.9, -0.2]))
POSE, SCENE, FIXED, CALIBRATION = (f"foxglove/studio/{name}" for name in ("pose", "scene", "fixed", "viewer/1/calibration"))


def bap(frame: int) -> Envelope:
    x, y, z = ACTOR.pose.position.tolist()
    message = built(
        m.UniversalBap, frame=frame, captured_ns=START_NS + frame, position=(x, y, z),
        angles=angles_by_name(TEN_PARTS, ACTOR.pose.angles),
    )  # fmt: skip
    return in_envelope(message, received_ns=START_NS + frame)


@dataclass
class Panel:
    """A client that subscribes to every advertised channel.

    received: by topic.  frames: of the received poses, in order.
    """

    socket: ClientConnection
    channels: dict[int, Channel] = field(default_factory=dict)
    received: dict[str, bytes] = field(default_factory=dict)
    frames: list[int] = field(default_factory=list)

    def wait(self, output: FoxgloveOutput, *topics: str) -> None:
        """Publish poses until a message of each of the topics is received."""
        for frame in range(1, 500):
            output.receive(bap(frame))
            self.read(0.01)
            if set(topics) <= set(self.received):
                return
        raise AssertionError(f"not received: {set(topics) - set(self.received)}")

    def read_until(self, frame: int) -> None:
        """Receive until the pose of `frame` has arrived."""
        for _ in range(1000):
            self.read(0.01)
            if self.frames[-1:] == [frame]:
                return
        raise AssertionError(f"frame {frame} not received; the last is {self.frames[-1:]}")

    def read(self, seconds: float) -> None:
        """Receive until no message arrives for `seconds`."""
        while True:
            try:
                data = self.socket.recv(timeout=seconds)
            except TimeoutError:
                return
            if isinstance(data, str):
                self._subscribe(json.loads(data))
            elif data[0] == 1:  # a message: its subscription and log time before it
                (subscription,) = struct.unpack_from("<I", data, 1)
                channel = self.channels[subscription]
                self.received[channel.topic] = data[13:]
                if channel.topic.endswith("/pose"):
                    self.frames.append(json.loads(data[13:])["frame"])

    def _subscribe(self, message: dict[str, object]) -> None:
        if message["op"] != "advertise":
            return
        new = []
        for one in message["channels"]:
            schema = b64decode(one["schema"]) if one["schemaEncoding"] == "protobuf" else one["schema"].encode()
            channel = Channel(one["topic"], one["encoding"], one["schemaName"], one["schemaEncoding"], schema)
            self.channels[one["id"]] = channel
            new.append({"id": one["id"], "channelId": one["id"]})
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": new}))

    def last(self, topic: str):
        channel = next(channel for channel in self.channels.values() if channel.topic == topic)
        data = self.received[topic]
        return json.loads(data) if channel.encoding == "json" else parsed(channel, data)


@pytest.fixture
def output() -> Iterator[FoxgloveOutput]:
    with closing(FoxgloveOutput(FoxgloveTable(port=free_ports(1)[0]), "studio")) as one:
        yield one


@pytest.fixture
def panel(output: FoxgloveOutput) -> Iterator[Panel]:
    with connected(output) as socket:
        yield Panel(socket)


def connected(output: FoxgloveOutput) -> ClientConnection:
    address = output.title.split()[1]
    host, _, port = address.removeprefix("ws://").rstrip("/").rpartition(":")
    plain = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    plain.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)  # else the system keeps megabytes for a slow reader
    plain.connect((host, int(port)))
    subprotocols = [Subprotocol("foxglove.sdk.v1")]
    return connect(address, sock=plain, subprotocols=subprotocols, max_size=None, close_timeout=0.2)


def test_a_client_gets_the_body_of_the_kinematics(output: FoxgloveOutput, panel: Panel) -> None:
    output.receive(BODY)
    panel.wait(output, SCENE, "foxglove/studio/body", POSE)
    (entity,) = panel.last(SCENE).entities
    frames = part_frames(ACTOR.anatomy, ACTOR.body, ACTOR.pose)
    middles = frames[:, :, 3] + ACTOR.body.sizes[:, :1] / 2 * frames[:, :, 1]
    np.testing.assert_allclose([xyz(one.pose.position) for one in entity.cylinders], middles, atol=1e-9)
    assert len(middles) == 10
    assert panel.last(POSE)["tracked"] is True


@pytest.mark.slow
def test_a_late_client_gets_the_messages_that_are_published_once(output: FoxgloveOutput, panel: Panel) -> None:
    output.receive(in_envelope(CAMERA, received_ns=START_NS))
    output.receive(BODY)
    panel.wait(output, CALIBRATION, FIXED)
    with connected(output) as socket:
        late = Panel(socket)
        late.wait(output, CALIBRATION, FIXED, SCENE)
        assert late.last(CALIBRATION).width == 160


def test_without_clients_all_channels_are_advertised_and_no_messages_are_converted(output: FoxgloveOutput) -> None:
    output.receive(BODY)
    for frame in range(50):
        output.receive(bap(frame))
    alone = output.counts()
    assert alone["subscriptions"] == 0
    assert alone["sent"] < 10
    with connected(output) as socket:
        panel = Panel(socket)
        panel.read(0.2)
        assert {"scene", "body", "joints", "pose", "fixed"} <= {c.topic.split("/")[-1] for c in panel.channels.values()}


def test_invented_names_take_a_limited_number_of_channels(output: FoxgloveOutput) -> None:
    rig, clock = replace(demo_rig("two-view"), name="studio"), ManualClock()
    bridge = PageBridge(rig, LocalNetwork(rig.name, clock).bus(), clock, OutputGroup((output,)))
    for number in range(2 * MAX_UNKNOWN_KEYS):
        bridge.receive(in_envelope(structs.replace(CAMERA, viewer=f"a{number}")))
        bridge.receive(in_envelope(built(m.Health, service="a", id=str(number))))
    for own in (CAMERA, built(m.Health, service="viewer", id="1")):
        bridge.receive(in_envelope(own))
    topics = {channel.topic for channel in output._channels}
    assert {CALIBRATION, "foxglove/studio/viewer/1/health"} <= topics
    assert len(topics) == 2 * (MAX_UNKNOWN_KEYS + 1) + 1  # with the fixed frames


def test_only_the_source_of_the_shown_actor_is_sent(output: FoxgloveOutput, panel: Panel) -> None:
    output.receive(BODY)
    output.send(stretched("fourteen-parts"), None)  # the tracker's
    for frame in range(5):
        output.receive(bap(frame))
    panel.read(0.1)
    assert panel.received.keys() <= {FIXED}
    output.send(stretched("ten-parts"), None)
    output.receive(BODY)
    panel.wait(output, SCENE)


@pytest.mark.nightly
def test_a_client_that_does_not_read_loses_its_oldest_frames_and_others_lose_none(
    output: FoxgloveOutput, panel: Panel
) -> None:
    output.receive(BODY)
    panel.wait(output, POSE)
    panel.socket.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)  # else the system may hold them all
    frames = list(range(1000, 4000))
    with connected(output) as another:
        reader = Panel(another)
        reader.wait(output, POSE)
        for frame in frames:
            output.receive(bap(frame))
            if frame % 20 == 19:
                reader.read_until(frame)
        assert [frame for frame in reader.frames if frame >= frames[0]] == frames
        panel.read_until(frames[-1])
        received = [frame for frame in panel.frames if frame >= frames[0]]
        assert len(received) < len(frames)
        assert received == sorted(received)


def test_a_damaged_message_is_counted_and_the_next_one_sent(output: FoxgloveOutput, panel: Panel) -> None:
    output.receive(BODY)
    panel.wait(output, SCENE)
    output.receive(in_envelope(built(m.Silhouette, captured_ns=1, size=(8, 8), region=(0, 0, 8, 8), data=b"\x01none")))
    assert output.counts()["failed"] == 1
    panel.received.clear()
    panel.wait(output, SCENE)


def test_a_port_in_use_and_an_unknown_host_are_errors_of_one_line(output: FoxgloveOutput) -> None:
    port = int(output.title.rpartition(":")[2])
    taken = rf"^animator\.foxglove: 127\.0\.0\.1:{port} cannot be listened on: Address already"
    with pytest.raises(OutputError, match=taken):
        FoxgloveOutput(FoxgloveTable(port=port), "studio")
    with pytest.raises(OutputError, match=r"no\.such\.host\.invalid:8765 cannot be listened on: failed to look up"):
        FoxgloveOutput(FoxgloveTable(host="no.such.host.invalid"), "studio")
