"""A recovered take has every intact message and an index; the lost part is reported."""

from pathlib import Path

import lz4.frame
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from tests.common.recording.test_writer import START_NS, record_take
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.writer import Channel, Recording, RecordingError
from zenocap.tools.takes.recover import recover

FRAMES = 150


@pytest.fixture
def intact(tmp_path: Path) -> Path:
    record_take(tmp_path / "take.mcap", FRAMES).close()
    return tmp_path / "take.mcap"


@pytest.fixture
def output(tmp_path: Path) -> Path:
    return tmp_path / "new" / "recovered.mcap"


def cut(path: Path, share: float) -> Path:
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    return path


@pytest.mark.parametrize("cut_bytes", [0, 20], ids=["whole", "without index"])
def test_a_take_with_all_messages_is_recovered_with_equal_bytes(intact: Path, output: Path, cut_bytes: int) -> None:
    original = intact.read_bytes()
    intact.write_bytes(original[: len(original) - cut_bytes])
    found = recover(intact, output)
    assert (found.lost, found.messages) == (False, 2 * FRAMES)
    assert output.read_bytes() == original


def test_truncated_take_gets_an_index_and_a_summary(intact: Path, output: Path) -> None:
    before = list(TakeReader(cut(intact, 0.5)).messages())
    found = recover(intact, output)
    take = TakeReader(output)
    assert list(take.messages()) == before
    assert take.cut is None
    assert take.attachments == {"rig.toml": b'name = "studio"'}
    assert take.metadata["versions"] == {"zenocap": "0.1.0", "a": "b"}
    assert take.metadata["recovered"] == {"from": "take.mcap", "lost": f"cut before its end, {len(before)} messages read"}
    assert found.lost
    assert (found.messages, found.start_ns, found.end_ns) == (len(before), START_NS, before[-1].log_ns)
    with output.open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(before)


def test_gap_reports_its_offset_and_times(intact: Path, output: Path) -> None:
    content = bytearray(intact.read_bytes())
    second = content.index(b"zstd", content.index(b"zstd") + 4)
    content[second + 60] ^= 0xFF
    intact.write_bytes(content)
    found = recover(intact, output)
    (gap,) = [gap for gap in found.gaps if gap.bytes]
    assert found.losses.chunks == 1
    assert gap.offset == second - 9 - 32
    assert 1e9 <= (gap.after_ns or 0) - (gap.before_ns or 0) <= 1.2e9
    assert list(TakeReader(output).messages()) == list(TakeReader(intact).messages())


def test_existing_files_are_neither_overwritten_nor_folders(intact: Path, output: Path) -> None:
    original = intact.read_bytes()
    with pytest.raises(RecordingError, match="is the take itself"):
        recover(intact, intact)
    with pytest.raises(RecordingError, match="is no folder"):
        recover(intact, intact / "recovered.mcap")
    output.parent.mkdir()
    output.write_text("mine")
    with pytest.raises(RecordingError, match="exists already"):
        recover(intact, output)
    assert (intact.read_bytes(), output.read_text()) == (original, "mine")


@pytest.mark.parametrize("content", [b"", b"no take at all", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + bytes(1000)])
def test_unrecoverable_file_leaves_no_output(tmp_path: Path, output: Path, content: bytes) -> None:
    (tmp_path / "take.mcap").write_bytes(content)
    with pytest.raises(UserError, match=r"nothing to recover|is no MCAP file"):
        recover(tmp_path / "take.mcap", output)
    assert not output.exists()


def packed(source: Path, target: Path, name: bytes = b"lz4") -> Path:
    """The same messages and attachments, in chunks compressed with LZ4; these named differently."""
    with source.open("rb") as file, target.open("wb") as written:
        reader, writer = make_reader(file), Writer(written, compression=CompressionType.LZ4)
        writer.start()  # type: ignore[no-untyped-call]
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data) if schema else 0
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, kind)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.add_attachment(0, 0, "rig.toml", "text/plain", b"rig")
        writer.finish()  # type: ignore[no-untyped-call]
    target.write_bytes(target.read_bytes().replace(b"\x03\0\0\0lz4", b"\x03\0\0\0" + name))
    return target


def test_chunks_of_lz4_are_read(intact: Path, output: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frame = lz4.frame.compress
    monkeypatch.setattr(lz4.frame, "compress", lambda data: frame(data[:99]) + frame(data[99:]))  # two
    take = TakeReader(packed(intact, intact.with_name("lz4.mcap")))
    assert [one.data for one in take.messages()] == [one.data for one in TakeReader(intact).messages()]
    assert set(take.chunks) == {"lz4"}
    assert take.cut is None
    assert not recover(intact.with_name("lz4.mcap"), output).lost


def test_another_compression_is_named_and_no_empty_take_is_written(intact: Path, output: Path) -> None:
    path = packed(intact, intact.with_name("lzo.mcap"), b"lzo")
    take = TakeReader(path)
    assert list(take.messages()) == []
    reason = "a chunk compressed with 'lzo', which is not read: allowed: zstd, lz4, or none"
    assert take.cut is not None
    assert reason in take.cut
    with pytest.raises(UserError, match=f"nothing to recover: it contains no intact message: {reason}"):
        recover(path, output)
    assert not output.exists()


def test_channels_of_other_programs_are_kept(tmp_path: Path, output: Path) -> None:
    recording = Recording(tmp_path / "take.mcap", rig="studio", start_ns=0)
    recording.write(Channel("/note", "json", "", "", b""), b"{}", 1, 2, 3)
    recording.write(Channel("/scene", "protobuf", "foxglove.SceneUpdate", "protobuf", b"\n"), b"", 4, 5)
    recording.close()
    recover(cut(tmp_path / "take.mcap", 0.99), output)
    assert list(TakeReader(output).messages()) == list(TakeReader(tmp_path / "take.mcap").messages())
    assert len(list(TakeReader(output).messages())) == 2


def test_full_disk_leaves_no_output(intact: Path, output: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(RecordingError, match=r"recovered\.mcap cannot be written: No space left on device"):
        recover(intact, output)
    assert not output.exists()
