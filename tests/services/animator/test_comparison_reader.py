"""Reader of two takes beside the page: poses as in exports, errors, early end."""

import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.services.animator.test_comparison import timed
from tests.support.places import GOLDEN
from tests.support.pose_tracks import moving
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.rig.animator import PageTable
from zenocap.services.animator.comparison import TakeComparison
from zenocap.services.animator.comparison_reader import ComparisonReader, ReadingStopped, Stopped, compare, read_track
from zenocap.services.animator.show import TakePage, show_take

PATIENCE_S = 60.0


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return write_take(tmp_path / "a.mcap", messages_of_track(moving(5)))


@pytest.mark.parametrize("raw", [False, True])
@pytest.mark.parametrize("golden", sorted(GOLDEN.glob("*.mcap")), ids=lambda path: path.stem)
def test_the_poses_are_those_of_exports(golden: Path, raw: bool) -> None:
    found, expected = read_track(golden, raw=raw), read_poses(golden, raw=raw)
    track = expected.track()
    assert found.name == golden.name
    assert found.captured_ns.tolist() == [bap.captured_ns for bap in expected.baps]
    np.testing.assert_array_equal(found.track.frames, track.frames)
    np.testing.assert_array_equal(found.track.times_s, track.times_s)
    np.testing.assert_array_equal(found.track.positions, track.positions)
    np.testing.assert_array_equal(found.track.angles, track.angles)
    np.testing.assert_array_equal(found.track.bdp.sizes, track.bdp.sizes)
    assert (found.track.lost, found.track.rate) == (track.lost, track.rate)


def test_of_two_poses_of_one_time_the_last_counts_and_lost_ones_are_empty(tmp_path: Path) -> None:
    messages = messages_of_track(moving(6, lost=(2,)))
    other = messages_of_track(moving(6, seed=2, lost=(4,)))
    take = write_take(tmp_path / "a.mcap", [*messages, *other[2:]])
    found, expected = read_track(take).track, read_poses(take).track()
    np.testing.assert_array_equal(found.positions, expected.positions)
    assert found.known.tolist() == [True, True, True, True, False, True]


def test_the_page_is_served_before_the_takes_are_read(take: Path) -> None:
    allowed = threading.Event()

    def read(ended: Stopped) -> TakeComparison:
        assert allowed.wait(PATIENCE_S)
        return TakeComparison(timed(), timed())

    with closing(TakePage(take, PageTable(port=0), compared=read)) as page:
        page.open()
        assert page.address.startswith("http://")
        assert page._reader.found is None
        allowed.set()
        page._reader._thread.join(PATIENCE_S)
        assert page._reader.found is not None
        assert page.problem == ""


def test_reading_ends_when_the_page_is_closed(take: Path) -> None:
    with pytest.raises(ReadingStopped):
        compare(take, take, stopped=lambda: True)
    begun, found = threading.Event(), []

    def read(ended: Stopped) -> TakeComparison:
        begun.set()
        while not ended():
            time.sleep(0.01)  # leaves the processor to the thread that ends it
        return compare(take, take, stopped=ended)

    reader = ComparisonReader(read, found.append)
    reader.start()
    assert begun.wait(PATIENCE_S)
    reader.close()
    assert (reader.found, reader.problem, found, reader._thread.is_alive()) == (None, "", [], False)


@pytest.mark.slow
def test_a_second_take_without_poses_ends_the_page_with_its_error(take: Path, tmp_path: Path) -> None:
    empty, addresses = write_take(tmp_path / "empty.mcap", messages_of_track(moving(5))[:2]), []
    with pytest.raises(UserError, match=r"empty\.mcap: no universal BAP"):
        show_take(
            take, PageTable(port=0), lambda: False, addresses.append,
            compared=lambda ended: compare(take, empty, stopped=ended),
        )  # fmt: skip
    assert len(addresses) == 1
