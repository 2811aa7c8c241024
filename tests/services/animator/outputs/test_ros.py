"""ROS 2 output: a subscriber on a real Zenoh network decodes it with rosbags."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from threading import Event
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import xxhash
from hypothesis import given, settings
from scipy.spatial.transform import Rotation

from tests.support.live_cameras import until
from tests.support.processes import PATIENCE_S
from tests.support.ros_listener import STORE, Received, RosListener, ros_network
from tests.support.virtual_actors import BODIES, PLACES, SHARES, at_the_ends, centres_of, posed, stretched
from zenocap.common.arrays import Floats
from zenocap.common.body.kinematics import part_frames
from zenocap.common.bus import zenoh_session
from zenocap.common.formats.rmw_zenoh import MARKER_ARRAY, TF_MESSAGE
from zenocap.common.formats.trajectories import convert
from zenocap.common.rig.animator import RosTable
from zenocap.common.runtime.clock import ManualClock
from zenocap.services.animator.outputs import ros
from zenocap.services.animator.outputs.output import OutputError
from zenocap.services.animator.outputs.ros import RosOutput
from zenocap.services.animator.outputs.ros_messages import ADD, BONES, DELETE, LOST, RosBody, no_markers
from zenocap.services.animator.states import ActorPose

DOMAIN = 7
TF, MARKERS = TF_MESSAGE.name, MARKER_ARRAY.name


def messages_of(actor: ActorPose, posture: str | None = None) -> tuple[bytes, bytes]:
    body = RosBody(actor.anatomy, actor.body, "map", "studio/")
    stamp_ns = actor.captured_ns
    return body.transforms(actor.pose, stamp_ns), body.markers(actor.pose, actor.lost, posture, stamp_ns)


def transforms_of(actor: ActorPose) -> list[Any]:
    return STORE.deserialize_cdr(messages_of(actor)[0], TF).transforms


def markers_of(actor: ActorPose, posture: str | None = None) -> list[Any]:
    return STORE.deserialize_cdr(messages_of(actor, posture)[1], MARKERS).markers


def matrix(turn: Any) -> Floats:
    return Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()


def world_frames(transforms: Sequence[Any]) -> dict[str, tuple[Floats, Floats]]:
    """Origin and rotation of every frame in that of the world, as tf2 composes them."""
    found = {"map": (np.zeros(3), np.eye(3))}
    for one in transforms:
        move, (origin, rotation) = one.transform.translation, found[one.header.frame_id]
        place = origin + rotation @ [move.x, move.y, move.z]
        found[one.child_frame_id] = place, rotation @ matrix(one.transform.rotation)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
@given(shares=SHARES, place=PLACES)
@settings(max_examples=20, deadline=None)
def test_messages_are_byte_for_byte_those_of_rosbags(name: str, shares: Floats, place: Floats) -> None:
    actor = posed(name, shares, place, lost=("left_arm",))
    tf, markers = messages_of(actor, "wave")
    for data, kind in ((tf, TF), (markers, MARKERS), (no_markers("map", 5), MARKERS)):
        assert bytes(STORE.serialize_cdr(STORE.deserialize_cdr(data, kind), kind)) == data


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize(("size", "place", "angle"), [(0.0, 1e3, 50.0), (10.0, -1e3, -50.0)])
def test_bodies_and_poses_at_the_ends_of_their_ranges_are_numbers(
    name: str, size: float, place: float, angle: float
) -> None:
    actor = at_the_ends(name, size, place, angle)
    moves, marks = [one.transform for one in transforms_of(actor)], markers_of(actor)
    vectors = [part for one in moves for part in (one.translation, one.rotation)]
    vectors += [part for one in marks for part in (one.pose.position, one.pose.orientation, one.scale, *one.points)]
    assert len(vectors) > 2 * len(BODIES[name][0].parts)
    assert np.isfinite([getattr(one, axis) for one in vectors for axis in "xyz"]).all()


@pytest.mark.parametrize("name", BODIES)
@given(shares=SHARES, place=PLACES)
@settings(max_examples=20, deadline=None)
def test_composed_transforms_are_the_frames_of_the_parts_in_the_axes_of_ros(
    name: str, shares: Floats, place: Floats
) -> None:
    actor = posed(name, shares, place)
    found = world_frames(transforms_of(actor))
    to_ros = convert(np.eye(3), "ros").T
    for part, frame in zip(actor.anatomy.parts, part_frames(actor.anatomy, actor.body, actor.pose), strict=True):
        origin, rotation = found[f"studio/{part}"]
        np.testing.assert_allclose(origin, to_ros @ frame[:, 3], atol=1e-9)
        np.testing.assert_allclose(rotation, to_ros @ frame[:, :3] @ to_ros.T, atol=1e-9)


def test_axes_are_forward_left_up() -> None:
    """A person who faces our Z stands upright along Z of ROS, the left arm towards Y, and faces X."""
    centres = convert(np.array([centres_of(stretched("ten-parts"))[name] for name in ("Hip", "Head", "LWrist")]), "ros")
    assert np.argmax(np.abs(centres[1] - centres[0])) == 2
    assert centres[1, 2] > centres[0, 2]
    assert centres[2, 1] > 0.5
    first = transforms_of(stretched("ten-parts"))[0]
    np.testing.assert_allclose(matrix(first.transform.rotation), np.eye(3), atol=1e-9)
    assert first.header.frame_id == "map"


@pytest.mark.parametrize("name", BODIES)
def test_markers_are_bones_joints_and_posture(name: str) -> None:
    actor = posed(name, np.full(25, 0.4), np.array([0.3, 1.0, -0.2]), lost=("right_leg",))
    bones, joints, text = markers_of(actor, "wave")
    centres = {name: convert(place, "ros") for name, place in centres_of(actor).items()}
    ends = [(point.x, point.y, point.z) for point in bones.points]
    np.testing.assert_allclose(ends, [centres[name] for start, end, _ in BONES for name in (start, end)])
    np.testing.assert_allclose([(p.x, p.y, p.z) for p in joints.points], list(centres.values()))
    pale = [np.allclose((c.r, c.g, c.b, c.a), LOST) for c in bones.colors]
    assert pale == [limb == "right_leg" for _, _, limb in BONES for _ in (0, 1)]
    assert sum(np.allclose((c.r, c.g, c.b, c.a), LOST) for c in joints.colors) == 2  # knee and ankle
    assert (text.text, text.action) == ("wave", ADD)
    assert text.pose.position.z > centres["Head"][2]
    assert all(one.lifetime.sec == 1 and one.header.frame_id == "map" for one in (bones, joints, text))
    assert len({(one.ns, one.id) for one in (bones, joints, text)}) == 3


def test_without_a_posture_its_text_is_removed() -> None:
    assert [one.action for one in markers_of(stretched("ten-parts"))] == [ADD, ADD, DELETE]


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(stretched("ten-parts").captured_ns)


@pytest.fixture(scope="module")
def network() -> Iterator[tuple[str, RosListener]]:
    with ros_network(DOMAIN) as found:
        yield found


def sent(output: RosOutput, listener: RosListener, actor: ActorPose) -> Received:
    """The received transforms of a pose, which is sent again and again: both sides connect in the background."""
    for _ in range(200):
        output.send(actor, "wave")
        with suppress(AssertionError):
            return listener.received(TF, 1, is_at(actor.captured_ns), wait_s=0.1)[-1]
    raise AssertionError(f"nothing arrived; {output.counts()}")


def is_at(stamp_ns: int) -> Callable[[Any], bool]:
    """Whether a message has a transform of a time."""
    stamp = divmod(stamp_ns, 10**9)
    return lambda message: any((t.header.stamp.sec, t.header.stamp.nanosec) == stamp for t in message.transforms)


@pytest.mark.slow
def test_a_subscriber_receives_transforms_and_markers_and_finds_the_node(
    network: tuple[str, RosListener], clock: ManualClock
) -> None:
    endpoint, listener = network
    output = RosOutput(RosTable(connect=endpoint, domain=DOMAIN), "studio", clock)
    actor = stretched("fourteen-parts")
    found = sent(output, listener, actor)
    assert found.key == f"{DOMAIN}/tf/tf2_msgs::msg::dds_::TFMessage_/{TF_MESSAGE.hash}"
    assert len(found.message.transforms) == len(actor.anatomy.parts)
    (markers, *_) = listener.received(MARKERS, 1)
    assert markers.key.startswith(f"{DOMAIN}/studio/skeleton/")

    tokens = listener.tokens(DOMAIN, 3)
    kinds = {token.split("/")[5]: token for token in tokens}
    assert len(tokens) == 3
    assert set(kinds) == {"NN", "MP"}
    (tf_token,) = [token for token in tokens if "/%tf/" in token]
    # GID, by which ROS knows the publisher of a message, is the hash of its token.
    number, sent_ns, gid = found.attachment[:8], found.attachment[8:16], found.attachment[17:]
    assert int.from_bytes(number, "little") >= 1
    assert int.from_bytes(sent_ns, "little") == clock.now_ns()
    assert gid == xxhash.xxh3_128_digest(tf_token.encode())[::-1]
    assert found.attachment[16] == 16

    before = len(listener.received(TF, 1))
    clock.set(actor.captured_ns + 100_000_000)
    output.send(stretched("fourteen-parts", frame=6, lost=("person",)), None)
    removed = listener.received(MARKERS, 1, lambda message: all(one.action == DELETE for one in message.markers))
    assert len(removed) == 1
    assert len(listener.received(TF, 1)) == before  # no transforms of a lost person
    assert output.counts()["sent"] >= 3
    output.close()
    assert listener.tokens(DOMAIN, 0) == set()


def test_stamps_are_capture_times_and_the_present_for_a_replay(
    network: tuple[str, RosListener], clock: ManualClock
) -> None:
    endpoint, listener = network
    output = RosOutput(RosTable(connect=endpoint, domain=DOMAIN, namespace="lab/two", frame="odom"), "studio", clock)
    actor = stretched("ten-parts", frame=12)
    clock.set(actor.captured_ns + 80_000_000)
    found = sent(output, listener, actor)
    assert [t.child_frame_id for t in found.message.transforms] == [f"lab/two/{part}" for part in actor.anatomy.parts]
    assert found.message.transforms[0].header.frame_id == "odom"
    clock.set(actor.captured_ns + 86_400 * 10**9)  # a day
    output.send(actor, None)
    assert len(listener.received(TF, 1, is_at(clock.now_ns()))) == 1
    output.close()


@pytest.mark.slow
def test_humble_receives_on_keys_without_type_hashes(network: tuple[str, RosListener], clock: ManualClock) -> None:
    endpoint, _ = network
    domain = DOMAIN + 1
    listener = RosListener(endpoint, domain, humble=True)
    output = RosOutput(RosTable(connect=endpoint, domain=domain, humble=True), "studio", clock)
    actor = stretched("ten-parts")
    assert sent(output, listener, actor).key.endswith("TFMessage_/TypeHashNotSupported")
    tokens = listener.tokens(domain, 3)
    assert sum("/TypeHashNotSupported/::," in token for token in tokens) == 2
    output.close()
    listener.close()


def test_a_missing_router_neither_blocks_nor_fails(clock: ManualClock) -> None:
    output = RosOutput(RosTable(connect="tcp/127.0.0.1:9", domain=DOMAIN), "studio", clock)
    for frame in range(3):
        output.send(stretched("ten-parts", frame=frame), None)
    assert not output.connected
    assert output.counts() == {"unconnected": 6}
    output.close()


def test_a_router_that_hangs_delays_the_end_by_a_limit(monkeypatch: pytest.MonkeyPatch, clock: ManualClock) -> None:
    monkeypatch.setattr(zenoh_session, "CLOSE_S", 0.05)
    output, released, left = RosOutput(RosTable(connect="tcp/127.0.0.1:1"), "studio", clock), Event(), []
    token = Mock(undeclare=lambda: left.append(released.wait(PATIENCE_S)))
    output._connection._graph = Mock(publishers=(), token=token)
    output.close()
    assert left == []
    released.set()
    until(lambda: left == [True], "it was not closed")


def test_a_missing_xxhash_is_one_line_with_the_remedy(monkeypatch: pytest.MonkeyPatch, clock: ManualClock) -> None:
    monkeypatch.setattr(ros, "import_module", Mock(side_effect=ModuleNotFoundError("No module named 'xxhash'")))
    with pytest.raises(OutputError, match=r"^animator\.ros: needs xxhash: .+ -m pip install 'zenocap\[ros\]' \(No module"):
        RosOutput(RosTable(), "studio", clock)
