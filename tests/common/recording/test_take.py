"""A take with Foxglove channels: readable from the file alone, and skipped by our readers."""

import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader

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


@pytest.fixture(scope="module")
def without_foxglove(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("without_foxglove") / "take.mcap", foxglove=False)


def test_every_channel_is_decoded_by_the_schema_in_the_file(with_foxglove: Path) -> None:
    counts: dict[str, int] = defaultdict(int)
    with with_foxglove.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if channel.message_encoding == "msgpack":
                continue
            row = Channel(channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data)
            counts[channel.topic.removeprefix("foxglove/studio/")] += 1
            if row.encoding == "json":
                assert set(json.loads(message.data)) <= set(json.loads(schema.data)["properties"])
                continue
            content = parsed(row, message.data)
            if schema.name == "foxglove.JointStates":
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
    seen = 0
    with with_foxglove.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=["foxglove/studio/scene"]):
            row = Channel(channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data)
            for entity in parsed(row, message.data).entities:
                assert entity.timestamp.seconds * 10**9 + entity.timestamp.nanos == message.publish_time
                for cylinder, frame in zip(entity.cylinders, expected[message.publish_time], strict=True):
                    foot = xyz(cylinder.pose.position) - turn(cylinder.pose.orientation)[:, 2] * cylinder.size.z / 2
                    np.testing.assert_allclose(foot, frame[:, 3], atol=1e-9)
                    seen += 1
    assert seen == 80 * len(TEN_PARTS.parts)


@pytest.mark.slow
def test_our_readers_ignore_foxglove_channels(with_foxglove: Path, without_foxglove: Path) -> None:
    ours = [
        [read for read in map(envelope, TakeReader(path).messages()) if read is not None]
        for path in (with_foxglove, without_foxglove)
    ]
    assert ours[0] == ours[1]
    assert [read.data for read in ours[0]] == [read.data for read in ours[1]]
    assert read_poses(with_foxglove).baps == read_poses(without_foxglove).baps
    both = {channel.key: channel for channel in info(with_foxglove).channels}
    assert {key: both[key] for key in both if key.startswith("zenocap/")} == {
        channel.key: channel for channel in info(without_foxglove).channels
    }
    assert info(with_foxglove).duration_s == info(without_foxglove).duration_s


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
    viewers = [
        msgspec.structs.replace(message, viewer=viewer)
        for viewer in ("1", "2")
        for message in (camera("1"), silhouette(), seen, m.Preview(frame=0, captured_ns=0, viewer="1", jpeg=b"x"))
    ]
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
