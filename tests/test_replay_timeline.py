"""Takes on one time line: every message at its place, from any place on, also of cut, damaged and several files."""

import random
from dataclasses import replace
from pathlib import Path

import pytest

from common.take.reading import TakeError
from common.topics import PARTIAL_BDP
from services.takes.replay.timeline import LONGEST_GAP_NS, Placed, Timeline
from tests.replay_takes import PERIOD_NS, RIG, START_NS, spoken, written

BDPS = [PARTIAL_BDP.at(RIG, viewer=viewer) for viewer in ("1", "2")]


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", spoken(50), flush_every=20)


def cut(path: Path, share: float) -> Path:
    data = path.read_bytes()
    short = path.with_name("cut.mcap")
    short.write_bytes(data[: round(share * len(data))])
    return short


def data_of(found: list[Placed]) -> list[bytes]:
    return [placed.recorded.data for placed in found]


def test_every_message_has_its_place_in_the_order_of_writing(take: Path) -> None:
    timeline = Timeline([take])
    found = list(timeline.read())
    assert [(each.data, each.received_ns - spoken(1)[0].received_ns) for each in spoken(50)] == [
        (placed.recorded.data, placed.place_ns) for placed in found
    ]
    assert timeline.duration_ns == found[-1].place_ns
    assert sum(timeline.keys.values()) == len(found)
    assert timeline.lost == {}


@pytest.mark.parametrize("place_ns", [0, 1, 5 * PERIOD_NS, 5 * PERIOD_NS + 2_000_000, 49 * PERIOD_NS, 10**12])
def test_reading_from_a_place_is_reading_all_and_leaving_out_what_lies_before(take: Path, place_ns: int) -> None:
    for path in (take, cut(take, 0.98)):
        timeline = Timeline([path])
        assert timeline.parts[0].indexed == (path == take)
        assert list(timeline.read(place_ns)) == [p for p in timeline.read() if p.place_ns >= place_ns]


def test_state_is_what_was_last_said_before_a_place(tmp_path: Path) -> None:
    later = [replace(each, received_ns=START_NS + 30 * PERIOD_NS) for each in spoken(1) if each.topic is PARTIAL_BDP][:1]
    all_of_it = sorted([*spoken(50), *later], key=lambda each: each.received_ns)
    path = written(tmp_path / "a.mcap", all_of_it, flush_every=20)
    for one in (path, cut(path, 0.9)):
        timeline = Timeline([one])
        assert timeline.last_before(0, BDPS) == []
        places = [recorded.log_ns - START_NS for recorded in timeline.last_before(20 * PERIOD_NS, BDPS)]
        assert places == [1_000_000, 2_000_000]
        assert [r.log_ns - START_NS for r in timeline.last_before(40 * PERIOD_NS, BDPS)] == [2_000_000, 30 * PERIOD_NS]
        assert timeline.last_before(40 * PERIOD_NS, []) == []


def test_the_files_of_one_recording_are_one_take(tmp_path: Path) -> None:
    whole = spoken(50)
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
def test_takes_of_different_days_follow_at_once(tmp_path: Path, apart_ns: int, gap_ns: int) -> None:
    first = spoken(5)
    end_ns = first[-1].received_ns
    second = spoken(5, end_ns + apart_ns - 1_000_000)  # its first message is 1 ms later
    timeline = Timeline([written(tmp_path / "a.mcap", first), written(tmp_path / "b.mcap", second)])
    places = [placed.place_ns for placed in timeline.read()]
    assert places[len(first)] - places[len(first) - 1] == gap_ns


def test_a_clock_that_was_set_back_stops_nothing(tmp_path: Path) -> None:
    hour_ns = 3600 * 10**9
    path = written(tmp_path / "a.mcap", [*spoken(10), *spoken(10, START_NS - hour_ns)], flush_every=5)
    timeline = Timeline([path])
    places = [placed.place_ns for placed in timeline.read()]
    assert not timeline.parts[0].indexed
    assert places == sorted(places)
    assert timeline.duration_ns == places[-1] < 20 * PERIOD_NS
    assert [p.place_ns for p in timeline.read(12 * PERIOD_NS)] == [place for place in places if place >= 12 * PERIOD_NS]


def test_a_cut_file_gives_what_is_whole_and_says_so(take: Path) -> None:
    short = cut(take, 0.3)
    timeline = Timeline([short])
    found = data_of(list(timeline.read()))
    assert found == [each.data for each in spoken(50)][: len(found)]
    assert 0 < len(found) < 152
    assert "cut before its end" in timeline.lost[short]


def test_a_damaged_chunk_costs_itself(take: Path) -> None:
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


@pytest.mark.parametrize("data", [b"", b"this is no take", bytes(1000)])
def test_what_is_no_take_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(TakeError, match=r"a\.mcap is no MCAP file"):
        Timeline([path])
    with pytest.raises(TakeError, match="cannot be read"):
        Timeline([tmp_path / "none.mcap"])


@pytest.mark.parametrize("seed", range(100))
def test_whatever_is_damaged_what_is_read_was_recorded(take: Path, seed: int) -> None:
    """Some bytes anywhere are others: reading ends, in order, and gives only what the checks let through."""
    chance = random.Random(seed)
    data = bytearray(take.read_bytes())
    for _ in range(chance.choice((1, 1, 3, 10))):
        data[chance.randrange(8, len(data))] = chance.randrange(256)
    if seed % 5 == 0:
        del data[chance.randrange(len(data)) :]
    take.write_bytes(bytes(data))
    recorded = {each.data for each in spoken(50)}
    try:
        timeline = Timeline([take])
        for place_ns in (0, 20 * PERIOD_NS):
            found = list(timeline.read(place_ns))
            assert {placed.recorded.data for placed in found} <= recorded
            assert [placed.place_ns for placed in found] == sorted(placed.place_ns for placed in found)
            timeline.last_before(place_ns, BDPS)
    except TakeError:
        assert len(data) < 200 or data[:8] != b"\x89MCAP0\r\n"
