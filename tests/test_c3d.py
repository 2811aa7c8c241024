"""C3D: two readers, one of them independent of the writer, find points, rate, labels and what is missing."""

import warnings
from pathlib import Path

import c3d
import ezc3d
import numpy as np
import pytest

from common.formats.axes import MATRICES, PER_METRE, Axes, Unit, turned
from common.formats.c3d import write_c3d
from common.formats.track import every_frame
from common.formats.trc import FormatError
from tests.pose_tracks import NAMES, moving

MICROMETRE = 1e-6


def read(path: Path) -> tuple[c3d.Reader, np.ndarray, np.ndarray]:
    """The reader, (n,) frame numbers and (n, points, 3) in the file's unit, NaN where missing."""
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # there is no analog data
        reader = c3d.Reader(file)
        frames, rows = [], []
        for number, points, _ in reader.read_frames():
            frames.append(number)
            rows.append(np.where(points[:, 3:4] < 0, np.nan, points[:, :3]))
    return reader, np.array(frames), np.array(rows, dtype=np.float64)


@pytest.mark.parametrize("axes", list(MATRICES))
@pytest.mark.parametrize("unit", list(PER_METRE))
def test_the_points_return_by_any_axes_and_unit(axes: Axes, unit: Unit, tmp_path: Path) -> None:
    data = moving(20, lost=(3, 4), rate=29.97).trajectories()
    write_c3d(tmp_path / "a.c3d", data, axes=axes, unit=unit)
    reader, frames, points = read(tmp_path / "a.c3d")
    np.testing.assert_allclose(points / PER_METRE[unit], turned(data.points, axes), atol=2 * MICROMETRE)
    assert np.isnan(points[[3, 4]]).all()
    assert reader.point_rate == pytest.approx(29.97)
    assert [label.strip() for label in reader.point_labels] == list(NAMES)
    assert reader.get("POINT:UNITS").string_value.strip() == unit
    assert reader.get("MANUFACTURER:SOFTWARE").string_value.strip() == "zenocap"
    assert list(frames) == list(range(1, 21))


def test_its_own_reader_finds_the_same_and_missing_ones_at_minus_one(tmp_path: Path) -> None:
    data = moving(5, lost=(2,)).trajectories()
    write_c3d(tmp_path / "a.c3d", data)
    points = ezc3d.c3d(str(tmp_path / "a.c3d"))["data"]["points"]
    np.testing.assert_allclose(points[:3].transpose(2, 1, 0) / 1e3, data.points, atol=2 * MICROMETRE)
    _, _, rows = read(tmp_path / "a.c3d")
    assert np.isnan(rows[2]).all()
    assert not np.isnan(rows[[0, 1, 3, 4]]).any()


def test_frame_k_is_at_index_k_and_a_part_says_where_it_begins(tmp_path: Path) -> None:
    track = moving(4, first=7)
    write_c3d(tmp_path / "a.c3d", every_frame(track).trajectories())
    reader, _, points = read(tmp_path / "a.c3d")
    assert (reader.first_frame, reader.last_frame) == (1, 11)
    np.testing.assert_allclose(points[7:] / 1e3, track.trajectories().points, atol=2 * MICROMETRE)
    write_c3d(tmp_path / "b.c3d", track.trajectories())
    reader, _, points = read(tmp_path / "b.c3d")
    assert (reader.first_frame, reader.last_frame, len(points)) == (8, 11, 4)


@pytest.mark.parametrize(("axes", "up"), [("y-up", "+Y"), ("z-up", "+Z"), ("unreal", "+Z")])
def test_the_screen_says_which_way_is_up(axes: Axes, up: str, tmp_path: Path) -> None:
    write_c3d(tmp_path / "a.c3d", moving().trajectories(), axes=axes)
    assert read(tmp_path / "a.c3d")[0].get("POINT:Y_SCREEN").string_value.strip() == up


def test_any_name_will_do(tmp_path: Path) -> None:
    write_c3d(tmp_path / "points", moving().trajectories())
    assert [path.name for path in tmp_path.iterdir()] == ["points"]
    assert len(read(tmp_path / "points")[2]) == 12


def test_more_frames_than_c3d_counts_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"last frame 65539: allowed in C3D: up to 65534"):
        write_c3d(tmp_path / "a.c3d", moving(first=65528).trajectories())
    assert list(tmp_path.iterdir()) == []
