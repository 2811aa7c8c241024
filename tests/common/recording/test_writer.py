"""A recording has every message, equal bytes on repetition, and never blocks its caller."""

from pathlib import Path
from unittest.mock import Mock

import pytest
from mcap.reader import make_reader

from tests.common.bus.test_inbox import bap, sighting
from tests.support.built_messages import built
from tests.support.foxglove_reader import in_envelope
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import encode, json_schema
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.recording.channel_limits import MAX_CHANNELS, MAX_UNKNOWN_KEYS
from zenocap.common.recording.writer import Attachment, Channel, Recording, RecordingError, no_conversion
from zenocap.common.topics import SIGHTING, UNIVERSAL_BAP

START_NS = 1_700_000_000_000_000_000
FRAME_NS = 33_333_333
FULL = Path("/dev/full")


def envelope(message: m.Message, received_ns: int) -> Envelope:
    return in_envelope(message, received_ns=received_ns)


def record_take(path: Path, frames: int, *more: str) -> Recording:
    """more: names of empty metadata."""
    metadata = {"versions": {"zenocap": "0.1.0", "a": "b"}, **{name: {} for name in more}}
    recording = Recording(
        path, rig="studio", start_ns=START_NS, metadata=metadata,
        attachments=(Attachment("rig.toml", "application/toml", b'name = "studio"'),),
    )  # fmt: skip
    for frame in range(frames):
        recording.record(envelope(sighting("1", frame), START_NS + frame * FRAME_NS))
        recording.record(envelope(bap(frame), START_NS + frame * FRAME_NS + 1000))
    return recording


def test_a_take_is_a_valid_mcap_file(tmp_path: Path) -> None:
    statistics = record_take(tmp_path / "take.mcap", 90).close()
    assert (statistics.messages, statistics.lost, statistics.failure) == (180, 0, None)
    with (tmp_path / "take.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.message_count == 180
        assert summary.statistics.chunk_count == 3
        assert {(channel.topic, channel.message_encoding) for channel in summary.channels.values()} == {
            ("zenocap/studio/viewer/1/sighting", "msgpack"), ("zenocap/studio/integrator/bap", "msgpack"),
        }  # fmt: skip
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        assert schemas["zenocap.Sighting"].encoding == "jsonschema"
        assert schemas["zenocap.Sighting"].data == json_schema(m.Sighting)
        schema, _, message = next(iter(reader.iter_messages(topics=[SIGHTING.at("studio", viewer="1")])))
        assert schema.name == "zenocap.Sighting"
        assert (message.log_time, message.publish_time, message.sequence) == (START_NS, 0, 0)
        assert message.data == encode(sighting("1", 0))
        metadata = {entry.name: dict(entry.metadata) for entry in reader.iter_metadata()}
        assert metadata["zenocap"] == {"rig": "studio", "schema_version": "1"}
        assert [attachment.data for attachment in reader.iter_attachments()] == [b'name = "studio"']


def test_two_takes_of_the_same_messages_are_equal(tmp_path: Path) -> None:
    record_take(tmp_path / "a.mcap", 100).close()
    record_take(tmp_path / "b.mcap", 100).close()
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize(
    "after_ns", [1_000_000_000, -50_000_000_000, None], ids=["a second", "a clock that was set back", "flush"]
)
def test_messages_are_written_to_disk_every_second_and_on_request(tmp_path: Path, after_ns: int | None) -> None:
    recording = record_take(tmp_path / "take.mcap", 15)
    small = (tmp_path / "take.mcap").stat().st_size
    if after_ns is None:
        recording.flush()
    else:
        recording.record(envelope(bap(99), START_NS + after_ns))
    assert (tmp_path / "take.mcap").stat().st_size > small
    recording.close()


def test_channels_of_other_programs_can_be_added(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "take.mcap", rig="studio", start_ns=START_NS)
    recording.write(Channel("/note", "json", "", "", b""), b"{}", START_NS, START_NS)
    recording.write(Channel("/scene", "protobuf", "foxglove.SceneUpdate", "protobuf", b"\n"), b"x", START_NS, START_NS)
    recording.close()
    with (tmp_path / "take.mcap").open("rb") as file:
        found = [(schema and schema.name, channel.topic) for schema, channel, _ in make_reader(file).iter_messages()]
    assert found == [(None, "/note"), ("foxglove.SceneUpdate", "/scene")]


@pytest.mark.slow
def test_the_number_of_channels_is_bounded(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    recording = Recording(tmp_path / "take.mcap", rig="studio", start_ns=0)
    for number in range(MAX_CHANNELS + 10):
        recording.write(Channel(f"key{number}", "json", "", "", b""), b"{}", number, number)
    recording.write(Channel("key0", "json", "", "", b""), b"{}", 9999, 9999)
    end = recording.close()
    assert (end.messages, end.lost, end.failure) == (MAX_CHANNELS + 1, 10, None)
    assert [line.count("further keys") for line in caplog.messages] == [1]


@pytest.mark.slow
def test_invented_names_do_not_displace_the_rigs_own_services_and_topics(tmp_path, caplog):
    """Thousands of services that the rig does not run, each with a health, before the rig's own begin."""
    converter = FoxgloveConverter(TEN_PARTS, "studio")
    own = (("viewer", "1"), ("integrator", "main"))
    recording = Recording(tmp_path / "take.mcap", rig="studio", start_ns=0, own=own, convert=converter.convert)
    for number in range(4200):
        recording.record(envelope(built(m.Health, service="invented", id=str(number)), START_NS + number))
        if number < 1000:
            recording.record(envelope(sighting(f"invented{number}", 0), START_NS + number))
    healths = [built(m.Health, service=service, id=id) for service, id in own]
    messages = [*healths, sighting("1", 0), bap(0)]
    for message in messages:
        recording.record(envelope(message, START_NS + FRAME_NS))
    end = recording.close()
    assert end.messages == 2 * MAX_UNKNOWN_KEYS + len(messages)
    assert end.lost == 5200 - 2 * MAX_UNKNOWN_KEYS
    with (tmp_path / "take.mcap").open("rb") as file:
        keys = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert {envelope(message, 0).key for message in messages} <= keys
    assert [line.count("keys of") for line in caplog.messages] == [1, 1]  # one line per topic


def test_a_message_without_bytes_is_encoded(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "take.mcap", rig="studio", start_ns=START_NS)
    recording.record(Envelope(UNIVERSAL_BAP.at("studio"), UNIVERSAL_BAP, bap(3), START_NS))
    assert recording.close().bytes == len(encode(bap(3)))


def test_an_existing_take_is_not_overwritten_and_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    record_take(tmp_path / "take.mcap", 1).close()
    with pytest.raises(RecordingError, match=r"take\.mcap exists already"):
        Recording(tmp_path / "take.mcap", rig="studio", start_ns=0)
    with pytest.raises(RecordingError, match=r"b\.mcap cannot be written: "):
        Recording(tmp_path / "take.mcap" / "b.mcap", rig="studio", start_ns=0)
    Recording(tmp_path / "take.mcap", rig="studio", start_ns=0, overwrite=True).close()


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full, the always full disk of Linux")
def test_a_disk_full_at_the_start_raises_an_error() -> None:
    with pytest.raises(RecordingError, match=r"/dev/full: recording stopped after 0 messages: No space left"):
        Recording(FULL, rig="studio", start_ns=0, overwrite=True)


def test_a_disk_that_fills_up_stops_the_recording_and_not_the_caller(tmp_path, monkeypatch, caplog):
    recording = record_take(tmp_path / "take.mcap", 15)
    monkeypatch.setattr("os.fsync", Mock(side_effect=OSError(28, "No space left on device")))
    for second in range(1, 5):
        recording.record(envelope(bap(second), START_NS + second * 1_000_000_000))
    statistics = recording.close()
    assert "take.mcap: recording stopped after 0 messages: No space left on device" in statistics.failure
    assert (statistics.messages, statistics.bytes, statistics.lost) == (0, 0, 34)
    assert len(caplog.records) == 1


def test_converted_messages_follow_the_message_with_its_times(tmp_path: Path) -> None:
    beside = Channel("/beside", "json", "", "", b"")
    path = tmp_path / "take.mcap"
    recording = Recording(path, rig="studio", start_ns=START_NS, convert=lambda each: [(beside, each.key.encode())])
    recording.record(envelope(bap(7), START_NS + 5))
    assert recording.close().unconverted == 0
    with path.open("rb") as file:
        own, other = [(channel, message) for _, channel, message in make_reader(file).iter_messages()]
    key = "zenocap/studio/integrator/bap"
    assert (own[0].topic, other[0].topic, other[1].data) == (key, "/beside", key.encode())
    for name in ("log_time", "publish_time", "sequence"):
        assert getattr(own[1], name) == getattr(other[1], name)


def test_a_failing_converter_loses_only_its_own_messages(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    broken = Mock(side_effect=RuntimeError("cannot show it"))
    alone, both = tmp_path / "alone.mcap", tmp_path / "both.mcap"
    for path, convert in ((alone, no_conversion), (both, broken)):
        recording = Recording(path, rig="studio", start_ns=START_NS, convert=convert)
        for frame in range(5):
            recording.record(envelope(bap(frame), START_NS + frame))
        end = recording.close()
    assert alone.read_bytes() == both.read_bytes()
    assert (end.messages, end.lost, end.failure, end.unconverted) == (5, 0, None, 5)
    words = "no conversion of zenocap/studio/integrator/bap frame 0 (further ones are counted only)"
    assert caplog.messages == [f"{both}: {words}: RuntimeError: cannot show it"]
