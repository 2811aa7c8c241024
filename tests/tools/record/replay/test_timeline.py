"""Takes on one time line: every message at its position, also of damaged files."""

import random
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import pytest

from tests.support.replay_takes import PERIOD_NS, RIG, START_NS, sample_messages, written
from zenocap.common.errors import UserError
from zenocap.common.recording import mcap_content
from zenocap.common.topics import PARTIAL_BDP, SIGHTING
from zenocap.tools.record.replay.timeline import LONGEST_GAP_NS, PlacedMessage, Timeline

BDPS = [PARTIAL_BDP.at(RIG, viewer=viewer) for viewer in ("1", "2")]


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", sample_messages(50), flush_every=20)


def truncated_copy(path: Path, share: float) -> Path:
    data = path.read_bytes()
    truncated = path.with_name("cut.mcap")
    truncated.write_bytes(data[: round(share * len(data))])
    return truncated


def data_of(found: list[PlacedMessage]) -> list[bytes]:
    return [placed.recorded.data for placed in found]


def test_messages_have_positions_in_the_order_of_recording(take: Path) -> None:
    timeline = Timeline([take])
    found = list(timeline.read())
    assert [(each.data, each.received_ns - sample_messages(1)[0].received_ns) for each in sample_messages(50)] == [
        (placed.recorded.data, placed.place_ns) for placed in found
    ]
    assert timeline.duration_ns == found[-1].place_ns
    assert sum(timeline.keys.values()) == len(found)
    assert timeline.lost == {}


@pytest.mark.parametrize("place_ns", [0, 1, 5 * PERIOD_NS, 5 * PERIOD_NS + 2_000_000, 49 * PERIOD_NS, 10**12])
def test_reading_from_a_position_skips_only_the_messages_before_it(take: Path, place_ns: int) -> None:
    for path in (take, truncated_copy(take, 0.98)):
        timeline = Timeline([path])
        assert (timeline.parts[0].index is not None) == (path == take)
        assert list(timeline.read(place_ns)) == [p for p in timeline.read() if p.place_ns >= place_ns]


def test_state_is_the_last_message_before_a_position(tmp_path: Path) -> None:
    bdp = next(each for each in sample_messages(1) if each.topic is PARTIAL_BDP)
    later = replace(bdp, received_ns=START_NS + 30 * PERIOD_NS)
    messages = sorted([*sample_messages(50), later], key=lambda each: each.received_ns)
    path = written(tmp_path / "a.mcap", messages, flush_every=20)
    for one in (path, truncated_copy(path, 0.9)):
        timeline = Timeline([one])
        assert timeline.last_before(0, BDPS) == []
        positions = [recorded.log_ns - START_NS for recorded in timeline.last_before(20 * PERIOD_NS, BDPS)]
        assert positions == [1_000_000, 2_000_000]
        assert [r.log_ns - START_NS for r in timeline.last_before(40 * PERIOD_NS, BDPS)] == [2_000_000, 30 * PERIOD_NS]
        assert timeline.last_before(40 * PERIOD_NS, []) == []


def test_the_files_of_one_recording_are_one_take(tmp_path: Path) -> None:
    whole = sample_messages(50)
    first = written(tmp_path / "a-10.mcap", whole[:70])
    second = written(tmp_path / "a-2.mcap", whole[70:])
    timeline = Timeline([second, first])
    assert data_of(list(timeline.read())) == [each.data for each in whole]
    assert [p.place_ns for p in timeline.read()] == [each.received_ns - whole[0].received_ns for each in whole]
    place_ns = 40 * PERIOD_NS
    assert list(timeline.read(place_ns)) == [p for p in timeline.read() if p.place_ns >= place_ns]
    assert timeline.log_at(place_ns) == whole[0].received_ns + place_ns
    assert len(timeline.last_before(place_ns, BDPS)) == 2


@pytest.mark.parametrize(("apart_ns", "gap_ns"), [(2 * 10**9, 2 * 10**9), (LONGEST_GAP_NS + 1, 0), (86400 * 10**9, 0)])
def test_long_gap_between_takes_is_removed(tmp_path: Path, apart_ns: int, gap_ns: int) -> None:
    first = sample_messages(5)
    end_ns = first[-1].received_ns
    second = sample_messages(5, end_ns + apart_ns - 1_000_000)  # its first message is 1 ms later
    timeline = Timeline([written(tmp_path / "a.mcap", first), written(tmp_path / "b.mcap", second)])
    positions = [placed.place_ns for placed in timeline.read()]
    assert positions[len(first)] - positions[len(first) - 1] == gap_ns


def test_clock_set_back_does_not_stop_playback(tmp_path: Path) -> None:
    hour_ns = 3600 * 10**9
    path = written(tmp_path / "a.mcap", [*sample_messages(10), *sample_messages(10, START_NS - hour_ns)], flush_every=5)
    timeline = Timeline([path])
    positions = [placed.place_ns for placed in timeline.read()]
    assert timeline.parts[0].index is None
    assert positions == sorted(positions)
    assert timeline.duration_ns == positions[-1] < 20 * PERIOD_NS
    assert [p.place_ns for p in timeline.read(12 * PERIOD_NS)] == [place for place in positions if place >= 12 * PERIOD_NS]


def test_truncated_file_gives_intact_messages_and_is_reported(take: Path) -> None:
    truncated = truncated_copy(take, 0.3)
    timeline = Timeline([truncated])
    found = data_of(list(timeline.read()))
    assert found == [each.data for each in sample_messages(50)][: len(found)]
    assert 0 < len(found) < 152
    assert "cut before its end" in timeline.lost[truncated]


def test_damaged_chunk_loses_only_its_own_messages(take: Path) -> None:
    data = bytearray(take.read_bytes())
    middle = data.index(b"\x28\xb5\x2f\xfd", len(data) // 3)  # where a zstd frame begins
    data[middle + 40] ^= 0xFF
    take.write_bytes(bytes(data))
    timeline = Timeline([take])
    whole = list(timeline.read())
    assert 100 < len(whole) < 152
    assert "damaged" in timeline.lost[take]
    for place_ns in (PERIOD_NS, 10 * PERIOD_NS, 30 * PERIOD_NS):
        assert list(timeline.read(place_ns)) == [p for p in whole if p.place_ns >= place_ns]


def test_a_chunk_larger_than_allowed_is_lost_from_every_position(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small file may claim any size, and the limit is that of all readers."""
    monkeypatch.setattr(mcap_content, "MAX_CHUNK", 100)
    timeline = Timeline([take])
    assert timeline.parts[0].index is not None
    assert list(timeline.read(PERIOD_NS)) == list(timeline.read()) == []
    assert timeline.last_before(20 * PERIOD_NS, BDPS) == []
    assert "damaged" in timeline.lost[take]


@pytest.mark.parametrize("data", [b"", b"this is no take", bytes(1000)])
def test_file_that_is_not_a_take_is_rejected(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"a\.mcap is no MCAP file"):
        Timeline([path])
    with pytest.raises(UserError, match="cannot be read"):
        Timeline([tmp_path / "none.mcap"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_messages_read_from_a_damaged_take_were_recorded(take: Path, seed: int) -> None:
    """Some bytes are changed: reading ends in order, and gives only messages that pass the checks."""
    rng = random.Random(seed)
    data = bytearray(take.read_bytes())
    for _ in range(rng.choice((1, 1, 3, 10))):
        data[rng.randrange(8, len(data))] = rng.randrange(256)
    if seed % 5 == 0:
        del data[rng.randrange(len(data)) :]
    take.write_bytes(bytes(data))
    recorded = {each.data for each in sample_messages(50)}
    try:
        timeline = Timeline([take])
        for place_ns in (0, 20 * PERIOD_NS):
            found = list(timeline.read(place_ns))
            assert {placed.recorded.data for placed in found} <= recorded
            assert [placed.place_ns for placed in found] == sorted(placed.place_ns for placed in found)
            timeline.last_before(place_ns, BDPS)
    except UserError:
        assert len(data) < 200 or data[:8] != b"\x89MCAP0\r\n"


@pytest.mark.slow
def test_state_of_a_long_take_is_found_without_reading_all_before(tmp_path, monkeypatch):
    path = written(tmp_path / "a.mcap", sample_messages(400), flush_every=10)
    timeline = Timeline([path])
    keys = [*BDPS, SIGHTING.at(RIG, viewer="1")]
    for place_ns in (20 * PERIOD_NS, 399 * PERIOD_NS):
        whole = [placed.recorded for placed in Timeline([path]).read() if placed.place_ns < place_ns]
        expected = {recorded.topic: recorded for recorded in whole if recorded.topic in keys}
        with patch.object(Timeline, "_records", autospec=True, side_effect=Timeline._records) as read:
            assert timeline.last_before(place_ns, keys) == sorted(expected.values(), key=whole.index)
        assert read.call_count <= 3  # of some hundred chunks: the latest, and that of the bodies
