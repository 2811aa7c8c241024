"""Foxglove messages of a rig's messages: deterministic, without duplicates, complete after errors."""

from unittest.mock import Mock

import cv2
import msgspec
import numpy as np
import pytest
from hypothesis import given, reject, settings

from tests.support.built_messages import built
from tests.support.built_messages import silhouette as silhouette_of
from tests.support.foxglove_reader import by_topic, in_envelope, parsed, turn, xyz
from tests.support.message_strategies import MESSAGES
from tests.support.two_view_scene import BDP, NAVEL, angles
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.conversion import angles_by_name, body_of, packed_points
from zenocap.common.formats.foxglove import scene
from zenocap.common.formats.foxglove.channels import FoxgloveMessage
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.services.tracker.body.average_body import body_of_height

BODY = m.UniversalBdp(frame=0, captured_ns=1_000, body=body_of(TEN_PARTS, BDP), ratio=1.0)
PIXELS = np.zeros((120, 160), np.uint8)
PIXELS[20:100, 61:90] = 1


RAISED = angles(right_shoulder_z=90.0, left_elbow_x=-40.0, navel_y=30.0)


def bap(frame: int, lost: list[str] | None = None) -> m.UniversalBap:
    return built(
        m.UniversalBap, frame=frame, captured_ns=2_000_000_000 + frame, position=(0.0, 0.95, 0.0),
        angles=angles_by_name(TEN_PARTS, RAISED), scores={"1": 0.8}, views={"1": "facade"}, lost=lost or [],
    )  # fmt: skip


def camera(viewer: str, captured_ns: int = 5) -> m.CameraInfo:
    return built(m.CameraInfo, captured_ns=captured_ns, viewer=viewer)


def silhouette() -> m.Silhouette:
    return silhouette_of("1", 0, 3, PIXELS)


def converted(*messages: m.Message) -> list[list[FoxgloveMessage]]:
    converter = FoxgloveConverter(TEN_PARTS, "studio")
    return [converter.convert(in_envelope(message)) for message in messages]


def topics(output: list[FoxgloveMessage]) -> list[str]:
    return [each.channel.topic.removeprefix("foxglove/studio/") for each in output]


def test_a_pose_gives_scene_transforms_joints_and_plot() -> None:
    _, output = converted(BODY, bap(0))
    assert topics(output) == ["pose", "joints", "body", "scene"]
    found = by_topic(output)
    frames = part_frames(TEN_PARTS, BDP, Pose(NAVEL, RAISED))
    (person,) = found["scene"].entities
    for cylinder, frame, size in zip(person.cylinders, frames, BDP.sizes, strict=True):
        half = turn(cylinder.pose.orientation)[:, 2] * cylinder.size.z / 2
        np.testing.assert_allclose(xyz(cylinder.pose.position) - half, frame[:, 3], atol=1e-9)
        np.testing.assert_allclose(xyz(cylinder.pose.position) + half, frame[:, 3] + size[0] * frame[:, 1], atol=1e-9)
    joints = {joint.name: joint.position for joint in found["joints"].joints}
    assert joints == bap(0).angles
    assert {part.child_frame_id for part in found["body"].transforms} == set(TEN_PARTS.parts)
    for message in (person, found["joints"], found["body"].transforms[0]):
        assert (message.timestamp.seconds, message.timestamp.nanos) == (2, 0)


def test_without_a_body_only_angles_are_published() -> None:
    (output,) = converted(bap(0))
    assert topics(output) == ["fixed", "pose", "joints"]


def test_a_lost_person_is_deleted_once_and_shown_again_when_found() -> None:
    *_, first, second, back = converted(BODY, bap(0), bap(1, ["person"]), bap(2, ["person"]), bap(3))
    assert topics(first) == ["pose", "scene"]
    assert [deletion.id for deletion in by_topic(first)["scene"].deletions] == ["person"]
    assert topics(second) == ["pose"]
    assert topics(back) == ["pose", "joints", "body", "scene"]


def test_a_camera_is_published_with_the_fixed_frames_and_again_only_when_changed() -> None:
    one, two, again, moved = converted(camera("1"), camera("2"), camera("1"), camera("1", captured_ns=6))
    assert topics(one) == ["fixed", "viewer/1/calibration", "fixed"]
    assert topics(two) == ["viewer/2/calibration", "fixed"]
    assert [each.child_frame_id for each in by_topic(two)["fixed"].transforms] == ["world", "viewer/1", "viewer/2"]
    assert again == []
    assert topics(moved) == ["viewer/1/calibration", "fixed"]


def test_each_camera_is_placed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All were placed again with each further one: 256 invented cameras kept the log for seconds."""
    turned = Mock(wraps=scene.matrix_to_quaternion)
    monkeypatch.setattr(scene, "matrix_to_quaternion", turned)
    converted(*map(camera, "12345"), camera("1", 6), camera("1", 6))
    assert turned.call_count == 6


def test_a_second_file_is_self_contained() -> None:
    messages = [camera("1"), BODY, bap(0)]
    assert converted(*messages) == converted(*messages)


def test_a_silhouette_is_an_image_of_the_whole_view_and_a_preview_is_copied_unchanged() -> None:
    silhouettes, previews = converted(silhouette(), m.Preview(frame=0, captured_ns=3, viewer="2", jpeg=b"\xff\xd8..."))
    assert topics(silhouettes) == ["fixed", "viewer/1/silhouette"]
    image = parsed(*silhouettes[1])
    assert (image.format, image.frame_id, image.timestamp.nanos) == ("png", "viewer/1", 3)
    shown = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(shown, 255 * PIXELS)
    image = parsed(*previews[0])
    assert (image.format, image.frame_id, image.data) == ("jpeg", "viewer/2", b"\xff\xd8...")


def test_a_body_of_another_anatomy_removes_the_figure() -> None:
    converter = FoxgloveConverter(TEN_PARTS, "studio")
    converter.convert(in_envelope(BODY))
    other = m.UniversalBdp(frame=1, captured_ns=0, body=m.Body(anatomy="other", sizes={}, offsets={}), ratio=1.0)
    with pytest.raises(ValueError, match="anatomy 'other': allowed"):
        converter.convert(in_envelope(other))
    assert "scene" not in topics(converter.convert(in_envelope(bap(0))))


def test_fixed_frames_are_repeated_after_a_failure() -> None:
    converter = FoxgloveConverter(TEN_PARTS, "studio")
    with pytest.raises(OverflowError):
        converter.convert(in_envelope(built(m.Health, captured_ns=2**32 * 10**9)))
    broken = m.Silhouette(frame=0, captured_ns=3, viewer="1", size=(8, 8), region=(0, 0, 8, 8), data=b"x")
    with pytest.raises(ValueError, match="1 bytes do not hold"):
        converter.convert(in_envelope(broken))
    assert topics(converter.convert(in_envelope(bap(0))))[0] == "fixed"


@pytest.mark.nightly
@settings(max_examples=200)
@given(MESSAGES.filter(lambda message: not isinstance(message, m.ClockQuery)))
def test_any_valid_message_can_be_read_back_or_is_refused(message: m.Message) -> None:
    until_2106 = msgspec.structs.replace(message, captured_ns=message.captured_ns % (2**32 * 10**9))
    try:
        (output,) = converted(until_2106)
    except (ValueError, OverflowError):
        reject()
    assert by_topic(output)
    assert output == converted(until_2106)[0]


def tracker_messages(lost: bool = False) -> list[m.Message]:
    body = body_of(FOURTEEN_PARTS, body_of_height(1.75))
    named = angles_by_name(FOURTEEN_PARTS, FOURTEEN_PARTS.neutral)
    pose = built(m.TrackerPose, frame=1, captured_ns=2_000_000_001, angles=named, lost=lost)
    return [m.TrackerBdp(frame=1, captured_ns=1, body=body), pose]


def test_the_trackers_body_is_shown_in_its_own_anatomy_and_deleted_when_lost() -> None:
    _, output = converted(*tracker_messages())
    assert topics(output) == ["pose", "joints", "body", "scene"]
    found = by_topic(output)
    (person,) = found["scene"].entities
    assert len(person.cylinders) == 14
    assert {part.child_frame_id for part in found["body"].transforms} == set(FOURTEEN_PARTS.parts)
    assert {joint.name for joint in found["joints"].joints} == set(FOURTEEN_PARTS.angles)
    *_, output = converted(*tracker_messages(), tracker_messages(lost=True)[1])
    assert topics(output) == ["pose", "scene"]
    assert by_topic(output)["scene"].deletions[0].id == "person"


def test_a_limb_that_the_tracker_has_lost_is_grey() -> None:
    body, pose = tracker_messages()
    (person,) = by_topic(converted(body, msgspec.structs.replace(pose, lost_limbs=["left_leg"]))[-1])["scene"].entities
    parts = zip(FOURTEEN_PARTS.parts, person.cylinders, strict=True)
    grey = {part for part, c in parts if c.color.r == c.color.g == c.color.b}
    assert {"left_upper_leg", "left_lower_leg"} <= grey
    assert all(part.startswith("left_") for part in grey)


def test_scene_points_are_a_point_cloud_in_the_world() -> None:
    points = np.array([[0.125, 1.5, -2.0], [3.0, 0.0, 0.25]])
    (output,) = converted(m.ScenePoints(frame=1, captured_ns=2_000_000_001, points=packed_points(points)))
    assert topics(output) == ["fixed", "points"]
    cloud = by_topic(output)["points"]
    assert cloud.frame_id == "world"
    assert [(field.name, field.offset) for field in cloud.fields] == [("x", 0), ("y", 4), ("z", 8)]
    np.testing.assert_allclose(np.frombuffer(cloud.data, "<f4").reshape(-1, 3), points)
    assert cloud.point_stride == 12
