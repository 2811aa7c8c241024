"""Index of a take: content, number of messages, last message; hostile files."""

import resource
import struct
import subprocess
import sys
import zlib
from functools import cache
from pathlib import Path

import pytest
import zstandard

from tests.common.recording.test_damage import MAGIC, chunk, record
from tests.common.recording.test_writer import record_take
from tests.support.places import ROOT
from zenocap.common.errors import UserError
from zenocap.common.recording.mcap_records import Records
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.summary import chunk_messages, last_message, read_summary
from zenocap.common.recording.take_account import take_account
from zenocap.common.topics import BOTH_WAYS_POSE, topic_at

FRAMES = 300
LIMIT_S = 20.0  # of processor time, for any small file
MOST_MB = 600


@pytest.fixture
def take(tmp_path: Path) -> Path:
    record_take(tmp_path / "take.mcap", FRAMES).close()
    return tmp_path / "take.mcap"


def test_the_summary_has_what_the_messages_have(take: Path) -> None:
    messages = list(TakeReader(take).messages())
    found = read_summary(take)
    times = [one.log_ns for one in messages]
    assert (found.messages, found.start_ns, found.end_ns) == (len(messages), min(times), max(times))
    assert {schema.name for schema in found.schemas.values()} == {one.schema for one in messages}
    with take.open("rb") as file:
        indexed = [one.data for chunk in found.chunks for one in chunk_messages(Records(file), chunk)]
    assert indexed == [one.data for one in messages]
    assert {channel.topic for channel in found.channels.values()} == {one.topic for one in messages}
    assert take_account(take).messages == len(messages)


def test_the_last_message_of_a_topic_is_found(take: Path) -> None:
    messages = list(TakeReader(take).messages())
    for topic in {topic_at(one.topic) for one in messages}:
        assert topic is not None
        found = last_message(take, topic)
        assert found[0] == [one.data for one in messages if topic_at(one.topic) is topic][-1]
    assert last_message(take, BOTH_WAYS_POSE) is None


@pytest.mark.parametrize("share", [0.3, 0.7, 0.99])
def test_the_messages_of_a_cut_take_are_counted(take: Path, share: float) -> None:
    content = take.read_bytes()
    take.write_bytes(content[: int(share * len(content))])
    assert read_summary(take) is None
    found = take_account(take)
    assert (found.messages, found.complete) == (sum(1 for _ in TakeReader(take).messages()), False)
    assert found.messages > 0 or share < 0.5


def test_what_is_no_take_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_bytes(bytes(1000))
    with pytest.raises(UserError, match="is no MCAP file"):
        take_account(tmp_path / "no.mcap")
    with pytest.raises(UserError, match="cannot be read"):
        take_account(tmp_path / "none.mcap")


def with_index(data: bytes, index: bytes) -> bytes:
    """A file with valid checksums around any records."""
    start = len(MAGIC) + len(data) + 13
    head = struct.pack("<BQ", 2, 20) + struct.pack("<QQ", start, 0)
    footer = head + struct.pack("<I", zlib.crc32(head, zlib.crc32(index)))
    return MAGIC + data + record(15, bytes(4)) + index + footer + MAGIC


def statistics(count: int) -> bytes:
    return record(11, struct.pack("<QHIIIIQQI", count, 0, 0, 0, 0, 1, 0, 0, 0))


def chunk_index(offset: int, channels: int) -> bytes:
    places = b"".join(struct.pack("<HQ", number, 0) for number in range(channels))
    head = struct.pack("<QQQQI", 0, 0, offset, 2**62, len(places))
    return record(8, head + places + struct.pack("<QI", 0, 4) + b"zstd" + bytes(16))


KEY = b"zenocap/demo/integrator/verdict"
CHANNEL = record(4, struct.pack("<HHI", 0, 0, len(KEY)) + KEY + struct.pack("<I", 7) + b"msgpack" + bytes(4))


@cache
def bomb() -> bytes:
    """A gigabyte in about 100 kB."""
    return zstandard.compress(bytes(1 << 30), 1)


SMALL_FILES = {
    "zeros": lambda: bytes(4 << 20),
    "zeros with the magic bytes": lambda: MAGIC + bytes(4 << 20),
    "zeros between the magic bytes": lambda: MAGIC + bytes(4 << 20) + MAGIC,
    "zeros before a footer": lambda: MAGIC + bytes(4 << 20) + record(2, struct.pack("<QQI", 8, 0, 0)) + MAGIC,
    "zeros as an index": lambda: with_index(b"", bytes(4 << 20)),
    "heads of empty records": lambda: MAGIC + struct.pack("<BQ", 15, 0) * 450_000,
    "heads of messages": lambda: MAGIC + struct.pack("<BQ", 5, 0) * 450_000,
    "heads of long messages": lambda: MAGIC + struct.pack("<BQ", 5, 1 << 20) * 450_000,
    "heads of chunks": lambda: MAGIC + struct.pack("<BQ", 6, 60) * 450_000,
    "ones": lambda: b"\x01" * (4 << 20),
    "chunk of a gigabyte": lambda: MAGIC + chunk(bomb(), 1 << 30),
    "chunk that claims a kilobyte": lambda: MAGIC + chunk(bomb(), 1000),
    "chunk that claims an exabyte": lambda: MAGIC + chunk(bomb(), 1 << 60),
    "lz4": lambda: MAGIC + chunk(bomb(), 1 << 30, b"lz4"),
    "many bombs": lambda: MAGIC + 10 * chunk(bomb(), 60 << 20),
    "index of bombs": lambda: with_index(chunk(bomb(), 60 << 20), CHANNEL + statistics(2**63) + 1000 * chunk_index(8, 1)),
    "schemas": lambda: MAGIC + record(3, struct.pack("<H", 1) + bytes(12)) * 150_000,
}
READ = """
import resource, sys, time
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
from zenocap.common.errors import UserError
from zenocap.common.recording.summary import last_message
from zenocap.common.recording.take_account import take_account
from zenocap.services.animator.playback import topics_shown
from zenocap.services.animator.states import TOPICS
from zenocap.services.animator.take_marks import verdict_update
path = Path(sys.argv[1])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for read in (take_account, verdict_update, lambda path: topics_shown(path, TOPICS)):
    started = time.process_time()
    try:
        read(path)
    except UserError as error:
        print(error)
    assert time.process_time() - started < float(sys.argv[2]), read
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024, "MB")
"""


def finished(line: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        line, cwd=ROOT, capture_output=True, text=True, timeout=250, check=False, stdin=subprocess.DEVNULL
    )


@pytest.mark.nightly
@pytest.mark.parametrize("name", SMALL_FILES)
def test_small_files_cost_neither_minutes_nor_gigabytes(tmp_path: Path, name: str) -> None:
    path = tmp_path / "small.mcap"
    path.write_bytes(SMALL_FILES[name]())
    done = finished([sys.executable, "-c", READ, str(path), str(LIMIT_S)])
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.splitlines()[-1].split()[0]) < MOST_MB


@pytest.mark.nightly
@pytest.mark.parametrize("command", ["info", "verify", "export", "show", "recover", "open_take"])
@pytest.mark.parametrize("name", ["zeros between the magic bytes", "many bombs"])
def test_every_reader_of_takes_answers_soon(tmp_path: Path, name: str, command: str) -> None:
    path = tmp_path / "small.mcap"
    path.write_bytes(SMALL_FILES[name]())
    arguments = {
        "export": ["export", str(path), "--to", "trc", "-o", str(tmp_path / "a.trc")],
        "recover": ["recover", str(path), "-o", str(tmp_path / "b.mcap")],
        "show": ["show", str(path), "--port", "0"],
    }.get(command, [command, str(path)])
    line = [sys.executable, "-m", "zenocap", *arguments]
    if command == "open_take":
        line = [sys.executable, "-c", "import sys, zenocap; zenocap.open_take(sys.argv[1])", str(path)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = finished(line)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < LIMIT_S
    assert done.returncode in (1, 3), (done.returncode, done.stdout, done.stderr)
    assert "Traceback" not in done.stderr or command == "open_take"
    assert after.ru_maxrss < 2 << 20  # kB
