"""Images rendered in advance: played on schedule, forwards and backwards."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.services.viewer.sources.test_sources import FakeTime, S, live, offline
from zenocap.common.errors import OpenError, SizeMismatch
from zenocap.common.rig.source_kinds import parse_source
from zenocap.common.rig.sources import Images, Rendered, SpecError
from zenocap.services.viewer.sources.rendered import rendered_frames, there_and_back
from zenocap.services.viewer.sources.resize import Fit

SIZE = (4, 3)
FIT = Fit(SIZE, SIZE)


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """Five images, image k of value k."""
    path = tmp_path / "film.npy"
    np.save(path, np.arange(5, dtype=np.uint8)[:, None, None, None] * np.ones((1, 3, 4, 3), np.uint8))
    return path


@given(st.integers(0, 10**6), st.integers(1, 50))
def test_consecutive_indices_are_adjacent_forwards_and_backwards(step: int, count: int) -> None:
    one, two = there_and_back(step, count), there_and_back(step + 1, count)
    assert 0 <= one < count
    assert abs(one - two) == (count > 1)


def test_live_frames_are_in_time_and_late_ones_are_skipped(film: Path) -> None:
    time = FakeTime(10 * S)
    frames = rendered_frames(Rendered(film, 10.0), 10.0, FIT, live(time, 9 * S))
    first = list(islice(frames, 3))
    assert [(f.frame, f.captured_ns) for f in first] == [(10, 10 * S), (11, 10 * S + S // 10), (12, 10 * S + S // 5)]
    assert [int(f.image[0, 0, 0]) for f in first] == [2, 3, 4]
    time.ns += S  # the reader pauses
    assert next(frames).frame == 22


def test_the_speed_of_the_motion_is_independent_of_the_rate(film: Path) -> None:
    frames = rendered_frames(Rendered(film, 10.0), 20.0, FIT, live(FakeTime()))
    assert [int(f.image[0, 0, 0]) for f in islice(frames, 6)] == [0, 0, 1, 1, 2, 2]


def test_offline_playback_ends(film: Path) -> None:
    assert [f.frame for f in rendered_frames(Rendered(film, 10.0), 10.0, FIT, offline())] == [0, 1, 2, 3, 4]


def test_invalid_image_arrays_are_refused(tmp_path: Path, film: Path) -> None:
    bad = tmp_path / "bad.npy"
    np.save(bad, np.zeros((2, 3)))
    for path in (bad, tmp_path / "none.npy", Path(__file__)):
        with pytest.raises(OpenError, match=path.name):
            next(rendered_frames(Rendered(path, 10.0), 10.0, FIT, offline()))
    with pytest.raises(SizeMismatch):
        next(rendered_frames(Rendered(film, 10.0), 10.0, Fit((8, 8), (8, 8)), offline()))


def test_source_text_has_file_and_rate() -> None:
    for rest in ("a.mp4", "a.npy?fps=0", "a.npy?fps=x", "a.npy?speed=2"):
        with pytest.raises(SpecError, match=r"rendered:FILE\.npy"):
            parse_source(f"rendered:{rest}", Path())
    assert parse_source("rendered:a.npy?fps=60", Path("films")) == Rendered(Path("films/a.npy"), 60.0)


def test_too_large_pictures_are_refused_before_one_is_read(tmp_path: Path) -> None:
    """A sparse file has few blocks on the disk, and would take all memory."""
    path = tmp_path / "large.npy"
    np.lib.format.open_memmap(path, mode="w+", dtype=np.uint8, shape=(1, 8193, 8192, 3))
    with pytest.raises(OpenError, match=r"large\.npy: pictures of 8192 x 8193 px: allowed: at most 67108864 pixels"):
        next(rendered_frames(Rendered(path, 10.0), 10.0, FIT, offline()))


def test_hidden_files_of_macos_are_no_pictures(tmp_path: Path) -> None:
    """They end in .png too, and came first."""
    (tmp_path / "._1.png").write_bytes(b"Mac OS X")
    assert "source" in Images(tmp_path, "*.png").missing()
    (tmp_path / "1.png").touch()
    assert Images(tmp_path, "*.png").files() == [tmp_path / "1.png"]
