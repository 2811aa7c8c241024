"""A take with Foxglove channels: readable from the file alone, and skipped by our readers."""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Message

from tests.common.formats.foxglove.test_converter import BODY, bap, camera, silhouette
from tests.support.built_messages import built
from tests.support.foxglove_reader import in_envelope, parsed, turn, xyz
from tests.support.places import ROOT
from tests.support.two_view_scene import BDP
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import part_frames
from zenocap.common.conversion import pose_of
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.recording.opening import new_recording
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.recording.writer import Channel, Recording, no_conversion
from zenocap.common.rig.rig import demo_rig
from zenocap.tools.takes.info import info

LAYOUT = ROOT / "deploy" / "lichtblick" / "demo.json"
START_NS = 1_700_000_000_000_000_000
FRAME_NS = 33_333_333


def rig_messages() -> Iterator[m.Message]:
    """A rig of two viewers; the person moves, is lost, and is found again."""
    yield from (camera("1"), camera("2"), BODY)
    for frame in range(90):
        yield silhouette()
        lost = ["person"] if 40 <= frame < 50 else []
        moved = msgspec.structs.replace(bap(frame, lost), position=(0.01 * frame, 0.95, 0.0))
        yield msgspec.structs.replace(moved, angles=moved.angles | {"right_elbow.x": 0.01 * frame})


def record(path: Path, *, foxglove: bool) -> Path:
    convert = FoxgloveConverter(TEN_PARTS, "studio").convert if foxglove else no_conversion
    recording = Recording(path, rig="studio", start_ns=START_NS, convert=convert)
    for k, message in enumerate(rig_messages()):
        recording.record(in_envelope(message, received_ns=START_NS + k * FRAME_NS // 2))
    end = recording.close()
    assert (end.lost, end.failure, end.unconverted) == (0, None, 0)
    return path


@pytest.fixture(scope="module")
def with_foxglove(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("with_foxglove") / "take.mcap", foxglove=True)


def foxglove_messages(take: Path) -> Iterator[tuple[str, Channel, Message]]:
    """Topic without the rig, channel and message."""
    with take.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if channel.message_encoding != "msgpack":
                row = Channel(channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data)
                yield channel.topic.removeprefix("foxglove/studio/"), row, message


def test_every_channel_is_decoded_by_the_schema_in_the_file(with_foxglove: Path) -> None:
    counts = Counter()
    for topic, row, message in foxglove_messages(with_foxglove):
        counts[topic] += 1
        if row.encoding == "json":
            assert set(json.loads(message.data)) <= set(json.loads(row.schema)["properties"])
            continue
        content = parsed(row, message.data)
        if row.schema_name == "foxglove.JointStates":
            assert {joint.name for joint in content.joints} == set(TEN_PARTS.angles)
    assert counts == {
        "fixed": 3, "viewer/1/calibration": 1, "viewer/2/calibration": 1, "viewer/1/silhouette": 90, "pose": 90,
        "joints": 80, "body": 80, "scene": 81,
    }  # fmt: skip


@pytest.mark.slow
def test_the_scene_of_each_pose_equals_the_kinematics(with_foxglove: Path) -> None:
    poses = read_poses(with_foxglove)
    expected = {
        received.publish_ns: part_frames(TEN_PARTS, BDP, pose_of(TEN_PARTS, pose))
        for received in TakeReader(with_foxglove).messages()
        if (ours := envelope(received)) is not None and isinstance(pose := ours.message, m.UniversalBap)
    }
    assert len(poses.baps) == len(expected) == 90
    scenes = [(row, message) for topic, row, message in foxglove_messages(with_foxglove) if topic == "scene"]
    shown = [(entity, message.publish_time) for row, message in scenes for entity in parsed(row, message.data).entities]
    assert len(shown) == 80
    for entity, publish_time in shown:
        assert entity.timestamp.seconds * 10**9 + entity.timestamp.nanos == publish_time
        for cylinder, frame in zip(entity.cylinders, expected[publish_time], strict=True):
            foot = xyz(cylinder.pose.position) - turn(cylinder.pose.orientation)[:, 2] * cylinder.size.z / 2
            np.testing.assert_allclose(foot, frame[:, 3], atol=1e-9)


@pytest.mark.slow
def test_our_readers_ignore_foxglove_channels(with_foxglove: Path, tmp_path: Path) -> None:
    without = record(tmp_path / "without.mcap", foxglove=False)
    both, alone = (list(filter(None, map(envelope, TakeReader(path).messages()))) for path in (with_foxglove, without))
    assert both == alone
    assert [read.data for read in both] == [read.data for read in alone]
    assert read_poses(with_foxglove).baps == read_poses(without).baps
    channels = [channel for channel in info(with_foxglove).channels if channel.key.startswith("zenocap/")]
    assert channels == list(info(without).channels)
    assert info(with_foxglove).duration_s == info(without).duration_s


def test_two_takes_of_the_same_messages_are_equal(with_foxglove: Path, tmp_path: Path) -> None:
    assert record(tmp_path / "again.mcap", foxglove=True).read_bytes() == with_foxglove.read_bytes()


@pytest.mark.parametrize("foxglove", [True, False])
def test_the_rig_file_switches_foxglove_channels(foxglove: bool, tmp_path: Path) -> None:
    rig = demo_rig("two-view")
    rig = replace(rig, log=msgspec.structs.replace(rig.log, foxglove=foxglove))
    recording = new_recording(rig, tmp_path / "take.mcap", START_NS, {})
    recording.record(in_envelope(bap(0), rig.name))
    recording.close()
    found = {received.topic for received in TakeReader(tmp_path / "take.mcap").messages()}
    assert ("foxglove/demo/pose" in found) is foxglove
    assert "zenocap/demo/integrator/bap" in found


def test_the_demo_layout_uses_channels_of_demo_takes(tmp_path: Path) -> None:
    recording = new_recording(demo_rig("two-view"), tmp_path / "take.mcap", START_NS, {})
    seen = built(m.Sighting, height=0.0, width=0.0)
    of_a_viewer = (camera("1"), silhouette(), seen, m.Preview(frame=0, captured_ns=0, viewer="1", jpeg=b"x"))
    viewers = [msgspec.structs.replace(message, viewer=viewer) for viewer in "12" for message in of_a_viewer]
    for message in (*viewers, BODY, bap(0)):
        recording.record(in_envelope(message, "demo"))
    recording.close()
    topics = {received.topic for received in TakeReader(tmp_path / "take.mcap").messages()}
    named: set[str] = set()
    fields: list[str] = []
    for panel in json.loads(LAYOUT.read_text())["configById"].values():
        named |= set(panel.get("topics", {})) | {v for k, v in panel.get("imageMode", {}).items() if k.endswith("Topic")}
        fields += [path["value"] for path in panel.get("paths", [])]
    named |= {field.partition(".")[0] for field in fields}
    assert named
    assert named <= topics
    joints = {field.removeprefix("foxglove/demo/pose.angles_deg.") for field in fields if "angles_deg" in field}
    assert joints
    assert joints <= set(TEN_PARTS.angles)
