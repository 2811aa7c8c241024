"""Reading a complete take; truncated and damaged takes give all intact messages and report the damage."""

import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from tests.common.bus.test_inbox import bap, sighting
from tests.common.recording.test_writer import FRAME_NS, START_NS, record_take
from zenocap.common import messages as m
from zenocap.common.codec import encode
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import Recorded, TakeReader, envelope
from zenocap.common.recording.summary import read_summary
from zenocap.common.recording.writer import Channel, Recording

FRAMES = 150


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("takes") / "take.mcap"
    record_take(path, FRAMES).close()
    return path


def expected() -> list[m.Message]:
    return [message for frame in range(FRAMES) for message in (sighting("1", frame), bap(frame))]


def messages(take: TakeReader) -> list[m.Message]:
    found = [envelope(recorded) for recorded in take.messages()]
    return [each.message for each in found if each is not None]


def test_a_complete_take_round_trips(complete: Path) -> None:
    take = TakeReader(complete)
    assert messages(take) == expected()
    assert take.cut is None
    assert take.chunks == {"zstd": len(read_summary(complete).chunks)}
    assert take.library == "zenocap"
    assert take.metadata["versions"] == {"zenocap": "0.1.0", "a": "b"}
    assert take.attachments == {"rig.toml": b'name = "studio"'}


def test_a_message_keeps_its_times(complete: Path) -> None:
    third = list(TakeReader(complete).messages())[4]
    assert (third.topic, third.schema, third.log_ns, third.publish_ns, third.sequence) == (
        "zenocap/studio/viewer/1/sighting", "zenocap.Sighting", START_NS + 2 * FRAME_NS, 2, 2,
    )  # fmt: skip
    found = envelope(third)
    assert (found.received_ns, found.data) == (third.log_ns, encode(sighting("1", 2)))


@pytest.mark.slow
@settings(max_examples=60)
@given(data=st.data())
def test_a_truncated_take_gives_its_first_messages_and_is_reported(complete, tmp_path_factory, data):
    content = complete.read_bytes()
    path = tmp_path_factory.mktemp("cut") / "take.mcap"
    path.write_bytes(content[: data.draw(st.integers(9, len(content) - 40))])
    take = TakeReader(path)
    found = messages(take)
    assert found == expected()[: len(found)]
    assert f"{len(found)} messages read" in take.cut


def test_a_damaged_chunk_loses_only_itself(complete: Path, tmp_path: Path) -> None:
    content = bytearray(complete.read_bytes())
    chunk = content.index(b"zstd", content.index(b"zstd") + 4)  # the second: the first has the channels
    content[chunk + 60] ^= 0xFF
    path = tmp_path / "take.mcap"
    path.write_bytes(content)
    take = TakeReader(path)
    found = messages(take)
    assert found[0] == sighting("1", 0)
    assert found[-1] == bap(FRAMES - 1)
    assert len(found) < 2 * FRAMES
    assert "damaged: 1 chunks" in take.cut
    assert take.chunks["zstd"] == len(read_summary(path).chunks) - 1


def test_flushed_messages_survive_a_crash(tmp_path: Path) -> None:
    recording = record_take(tmp_path / "take.mcap", FRAMES)  # still open, as after a crash
    take = TakeReader(tmp_path / "take.mcap")
    found = messages(take)
    assert 2 * FRAMES - len(found) <= 2 * 31  # one second of two messages a frame
    assert found == expected()[: len(found)]
    assert take.cut is not None
    recording.close()


def test_messages_of_other_programs_are_not_decoded(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "take.mcap", rig="studio", start_ns=0)
    recording.write(Channel("/note", "json", "", "", b""), b"{}", 1, 1)
    recording.close()
    found = list(TakeReader(tmp_path / "take.mcap").messages())
    assert found == [Recorded("/note", "json", "", b"{}", 1, 1, 0)]
    assert envelope(found[0]) is None


def test_descriptions_beyond_the_limit_are_reported_as_damage(complete: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("zenocap.common.recording.reader.MAX_KEPT", 1_000_000)
    assert messages(TakeReader(complete)) == expected()
    monkeypatch.setattr("zenocap.common.recording.reader.MAX_KEPT", 100)
    take = TakeReader(complete)
    assert list(take.messages()) == []
    assert take.attachments == {}
    assert "300 messages of unknown channels" in take.cut


def test_a_file_with_messages_outside_of_chunks_is_read_and_repaired(tmp_path: Path) -> None:
    path = tmp_path / "plain.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start()
        channel = writer.register_channel("/note", "json", 0)
        for number in range(100):
            writer.add_message(channel, number, b'{"text": "hello"}', number, number)
        writer.finish()
    take = TakeReader(path)
    assert len(list(take.messages())) == 100
    assert take.cut is None
    content = bytearray(path.read_bytes())
    fifth = content.index(b"\x05" + (22 + 17).to_bytes(8, "little"), 400)
    content[fifth + 1] ^= 0x40
    path.write_bytes(content)
    found = [each.sequence for each in take.messages()]
    assert len(found) == 99
    assert found == sorted(found)
    assert take.cut is not None


@pytest.mark.parametrize("order", ["as written", "set back", "reversed", "shuffled", "by channel"])
def test_messages_in_another_order_than_that_of_time_are_noted(tmp_path: Path, order: str) -> None:
    """They gave another body, and `info` other gaps, without a word; a clock that is set back is no such order."""
    rows = [(channel, number, number * 10**8 + channel) for number in range(200) for channel in range(4)]
    back = [(*row[:2], row[2] - 10**10) if row[1] > 100 else row for row in rows]
    written = {
        "as written": rows, "set back": back, "reversed": rows[::-1], "by channel": sorted(rows),
        "shuffled": random.Random(1).sample(rows, len(rows)),
    }[order]  # fmt: skip
    path = tmp_path / "take.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels = [writer.register_channel(f"/{number}", "json", 0) for number in range(4)]
        for channel, sequence, log_ns in written:
            writer.add_message(channels[channel], log_ns + 10**11, b"{}", 10**12 - log_ns, sequence)
        writer.finish()
    take = TakeReader(path)
    assert len(list(take.messages())) == len(rows)
    noted = take.cut is not None and "its messages are in another order than that of time" in take.cut
    assert noted is (order not in ("as written", "set back"))


@pytest.mark.parametrize("content", [b"", b"\x89MC", b"hello, this is no take at all"])
def test_a_file_that_is_missing_or_not_a_take_is_refused(tmp_path: Path, content: bytes) -> None:
    take = TakeReader(tmp_path / "take.mcap")
    with pytest.raises(UserError, match="cannot be read: No such file"):
        list(take.messages())
    take.path.write_bytes(content)
    with pytest.raises(UserError, match="is no MCAP file"):
        list(take.messages())
