"""Damaged and hostile takes: no traceback, no hang, bounded memory, the right exit status.

The full measurement is `python -m benchmarks damage`; this is a quick one on a small take.
"""

import io
import random
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest
import zstandard

from benchmarks.cases.takes.damage import KINDS, Damaging, Findings, Judge, corruptions, truncations
from tests.common.recording.test_writer import record_take
from tests.support.places import ROOT
from zenocap.common.recording.mcap_records import Attachment, ChunkEnd, Damage, Message, NotMcap, Records
from zenocap.common.recording.reader import TakeReader

FRAMES = 300
MAGIC = b"\x89MCAP0\r\n"


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Judge:
    folder = tmp_path_factory.mktemp("damage")
    record_take(folder / "take.mcap", FRAMES).close()
    return Judge(folder / "take.mcap", folder)


@pytest.mark.nightly
def test_takes_truncated_at_any_byte_are_read(judge: Judge) -> None:
    findings = Findings()
    truncations(judge, findings, range(0, 101, 4))
    assert findings.faults == []
    # (3, 1): cut before its first message, of which `recover` makes no empty take.
    assert findings.statuses.keys() == {(1, 1), (3, 1), (3, 3), (3, 0), (0, 0)}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_takes_with_random_damage_are_read(judge: Judge, kind: Damaging) -> None:
    findings = Findings()
    corruptions(judge, kind, 8, 42, findings)
    assert findings.faults == []


def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def chunk(data: bytes, size: int, compression: bytes = b"zstd", crc: int = 0) -> bytes:
    head = struct.pack("<QQQII", 0, 0, size, crc, len(compression)) + compression
    return record(6, head + struct.pack("<Q", len(data)) + data)


def read(content: bytes) -> list[object]:
    return list(Records(io.BytesIO(content)))


HEADER = MAGIC + record(1, bytes(8))
HOSTILE = {
    "a record of 2^63 bytes": HEADER + struct.pack("<BQ", 6, 2**63),
    "a chunk that declares 2^60 bytes": HEADER + chunk(b"x", 2**60),
    "a decompression bomb": HEADER + chunk(zstandard.compress(bytes(63 << 20)), 10),
    "a decompression bomb of declared size": HEADER + chunk(zstandard.compress(bytes(200 << 20)), 200 << 20),
    "a frame that declares 2^50 bytes": HEADER + chunk(b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 2**50) + b"\1\0\0", 100),
    "an unknown compression": HEADER + chunk(b"x" * 100, 100, b"xz\xff\xff"),
    "a chunk in a chunk": HEADER + chunk(record(6, bytes(100)), 109, b""),
    "a message of 3 bytes": HEADER + chunk(record(5, b"abc"), 12, b""),
    "a message longer than its chunk": HEADER + chunk(struct.pack("<BQ", 5, 2**62) + bytes(50), 59, b""),
    "a name that is not UTF-8": HEADER + record(12, struct.pack("<I", 2) + b"\xff\xfe" + bytes(4)),
    "an attachment of 2^64 bytes": HEADER + record(9, bytes(24) + b"\xff" * 8 + bytes(4)),
    "an index that refers to itself": HEADER + record(15, bytes(4)) + record(2, struct.pack("<QQI", 17, 17, 0)) + MAGIC,
    "many record headers": HEADER + struct.pack("<BQ", 1, 2**30) * 20_000,
    "zeros": HEADER + bytes(3 << 20),
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE)
def test_hostile_files_are_reported_as_damage(content: bytes) -> None:
    found = read(content)
    assert any(isinstance(item, Damage) for item in found)
    assert not any(isinstance(item, Message) for item in found)


@pytest.mark.nightly
def test_hostile_files_take_little_memory(tmp_path: Path) -> None:
    """The memory of the reading process is limited to far below the declared sizes."""
    bombs = HEADER + b"".join(chunk(zstandard.compress(bytes(60 << 20)), size) for size in (10, 60 << 20, 2**40)) * 5
    (tmp_path / "take.mcap").write_bytes(bombs)
    script = (
        "import sys, resource; from pathlib import Path; from zenocap.common.recording.reader import TakeReader;"
        "limit = int(sys.argv[2]); resource.setrlimit(resource.RLIMIT_DATA, (limit, limit));"
        "take = TakeReader(Path(sys.argv[1])); print(len(list(take.messages())), take.cut)"
    )
    run = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "take.mcap", str(1 << 30)],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "damaged: 15 chunks" in run.stdout


def test_a_wrong_record_length_loses_only_its_chunk(judge: Judge) -> None:
    content = bytearray(judge.content)
    second = content.index(b"zstd", content.index(b"zstd") + 4) - 40
    assert content[second - 1] == 6
    chunks = messages_of_chunks(judge.content)
    for wrong in (0, 1, 70, 5000, 10**6, 2**40, 2**64 - 1):
        content[second : second + 8] = wrong.to_bytes(8, "little")
        assert messages_of_chunks(bytes(content)) == [chunks[0], *chunks[2:]], wrong


def messages_of_chunks(content: bytes) -> list[list[Message]]:
    """Messages of each intact chunk."""
    chunks: list[list[Message]] = [[]]
    for item in read(content):
        if isinstance(item, Message):
            chunks[-1].append(item)
        elif isinstance(item, ChunkEnd):
            chunks.append([])
    assert not chunks.pop()
    return chunks


FIELDS = struct.pack("<HH", 1, 0) + b"".join(struct.pack("<I", len(text)) + text for text in (b"/note", b"json", b""))
CHANNEL, NOTE = record(4, FIELDS), record(5, struct.pack("<HIQQ", 1, 0, 5, 5) + b"{}")
OWN, END, FOOTER = record(0x80, b"of another program"), record(15, bytes(4)), record(2, bytes(20)) + MAGIC
FILE = bytes(24) + struct.pack("<Q4s", 4, b"file")  # an attachment, before its checksum
MORE = record(9, FILE + struct.pack("<I", zlib.crc32(FILE)) + b"more")
FIRST, MIXED = CHANNEL + NOTE, record(4, FIELDS + b"more") + OWN + NOTE + NOTE
TWO = zstandard.compress(FIRST[:40]) + zstandard.compress(FIRST[40:])  # frames of Zstandard may follow each other
VALID = {  # two notes
    "private records, one without content": (OWN, CHANNEL, OWN, record(0xFF, b""), NOTE, OWN, NOTE, END),
    "kinds of a later version": (record(0x10, b"later"), CHANNEL, NOTE, record(0x7F, bytes(40)), NOTE, END),
    "a channel with more fields": (record(4, FIELDS + b"more"), NOTE, NOTE, END),
    "a data end with more fields": (CHANNEL, NOTE, NOTE, record(15, bytes(12))),
    "a footer with more fields": (CHANNEL, NOTE, NOTE, END, record(2, bytes(28)) + MAGIC),
    "an attachment with more fields": (CHANNEL, NOTE, MORE, NOTE, END),
    "a private record in the index": (CHANNEL, NOTE, NOTE, END, OWN),
    "messages behind a chunk": (chunk(FIRST, len(FIRST), b""), NOTE, END),
    "a chunk of two Zstandard frames": (chunk(TWO, len(FIRST), crc=zlib.crc32(FIRST)), NOTE, END),
    "a private record in a chunk": (chunk(MIXED, len(MIXED), b"", zlib.crc32(MIXED)), END),
    "a chunk with more fields": (record(6, chunk(MIXED, len(MIXED), b"")[9:] + b"more"), END),
}


@pytest.mark.parametrize("records", VALID.values(), ids=VALID)
def test_what_later_versions_and_other_programs_may_write_is_no_damage(tmp_path: Path, records: tuple[bytes, ...]) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(HEADER + b"".join(records) + (b"" if records[-1].endswith(MAGIC) else FOOTER))
    take = TakeReader(path)
    assert [(one.topic, one.data) for one in take.messages()] == [("/note", b"{}")] * 2
    assert take.cut is None
    assert [item.data for item in read(path.read_bytes()) if isinstance(item, Attachment)] == [b"file"] * (MORE in records)


def test_a_chunk_whose_kind_is_damaged_is_no_record_of_another_program() -> None:
    content = bytearray(HEADER + chunk(MIXED, len(MIXED), b"") + END + FOOTER)
    content[len(HEADER)] |= 0x80
    assert [item.why for item in read(bytes(content)) if isinstance(item, Damage)] == ["no record"]


def test_a_chunk_that_is_larger_than_is_read_is_named(tmp_path: Path) -> None:
    path, content = tmp_path / "a.mcap", FIRST + bytes(65 << 20)
    path.write_bytes(HEADER + chunk(zstandard.compress(content), len(content)) + END + FOOTER)
    take = TakeReader(path)
    assert list(take.messages()) == []
    reason = "a chunk of more than 64 MiB uncompressed, 65, which is not read"
    assert take.cut == f"{path}: 1 chunks lost: {reason}; 0 messages read"


def test_checksums_of_decompressed_chunks_are_verified() -> None:
    data = record(5, bytes(30))
    good = read(HEADER + chunk(data, len(data), b"", zlib.crc32(data)))
    bad = read(HEADER + chunk(data, len(data), b"", zlib.crc32(data) ^ 1))
    assert sum(isinstance(item, Message) for item in good) == 1
    assert next(item.why for item in bad if isinstance(item, Damage)) == "a chunk with a wrong checksum"


class CountingFile(io.BytesIO):
    """Counts the bytes that are read."""

    total = 0

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        self.total += len(data)
        return data


@pytest.mark.parametrize(
    "content",
    [
        (b"\0" + record(15, bytes(4))) * 5000,  # a record after each byte of noise
        b"\x0c\0\0\0\0\0\0\0\0" * 8000,  # nested starts of records
        struct.pack("<BQ", 9, 60_000) * 8000,
        (record(12, struct.pack("<I", 4) + b"name" + struct.pack("<I", 3) + b"abc")) * 3000,
        bytes(100_000),
    ],
    ids=["noise", "nested headers", "attachment headers", "broken metadata", "zeros"],
)
def test_the_number_of_bytes_read_is_bounded(content: bytes) -> None:
    file = CountingFile(HEADER + content)
    assert any(isinstance(item, Damage) for item in Records(file))
    assert file.total < 100 * len(content)


@pytest.mark.parametrize("seed", range(20))
def test_random_bytes_raise_an_error(seed: int) -> None:
    noise = random.Random(seed).randbytes(100_000)
    with pytest.raises(NotMcap):
        read(noise)
