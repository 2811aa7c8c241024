"""C3D: two readers find points, rate, labels and missing points."""

import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import c3d
import ezc3d
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.support.pose_tracks import NAMES, moving
from zenocap.common.errors import UserError
from zenocap.common.formats.c3d import write_c3d
from zenocap.common.formats.pose_track import every_frame
from zenocap.common.formats.trajectories import MATRICES, PER_METRE, Axes, Trajectories, Unit, convert

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
def test_points_round_trip_in_any_axes_and_unit(axes: Axes, unit: Unit, tmp_path: Path) -> None:
    data = moving(20, lost=(3, 4), rate=29.97).trajectories()
    write_c3d(tmp_path / "a.c3d", data, axes=axes, unit=unit)
    reader, frames, points = read(tmp_path / "a.c3d")
    np.testing.assert_allclose(points / PER_METRE[unit], convert(data.points, axes), atol=2 * MICROMETRE)
    assert np.isnan(points[[3, 4]]).all()
    assert reader.point_rate == pytest.approx(29.97)
    assert [label.strip() for label in reader.point_labels] == list(NAMES)
    assert reader.get("POINT:UNITS").string_value.strip() == unit
    assert reader.get("MANUFACTURER:SOFTWARE").string_value.strip() == "zenocap"
    assert list(frames) == list(range(1, 21))


def test_ezc3d_reads_the_same_points_and_residual_minus_one_for_missing_ones(tmp_path: Path) -> None:
    data = moving(5, lost=(2,)).trajectories()
    write_c3d(tmp_path / "a.c3d", data)
    points = ezc3d.c3d(str(tmp_path / "a.c3d"))["data"]["points"]
    np.testing.assert_allclose(points[:3].transpose(2, 1, 0) / 1e3, data.points, atol=2 * MICROMETRE)
    _, _, rows = read(tmp_path / "a.c3d")
    assert np.isnan(rows[2]).all()
    assert not np.isnan(rows[[0, 1, 3, 4]]).any()


@settings(max_examples=12, deadline=None)
@given(st.integers(1, 700), st.integers(1, 4), st.integers(0, 60_000))
@example(256, 2, 0)
@example(511, 1, 0)
def test_any_number_of_points_is_read_back_with_its_names(points: int, frames: int, first: int) -> None:
    """A parameter has 255 texts at most: the others are in LABELS2 and so on."""
    names = tuple(f"P{k}" for k in range(points))
    places = np.random.default_rng(points).uniform(0.1, 2.0, (frames, points, 3))
    numbers = np.arange(first, first + frames)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.c3d"
        write_c3d(path, Trajectories(names, numbers, numbers / 30.0, places, 30.0))
        found = ezc3d.c3d(str(path))
    point = found["parameters"]["POINT"]
    parts = [point[key]["value"] for key in ("LABELS", "LABELS2", "LABELS3") if key in point]
    assert [name for part in parts for name in part] == list(names)
    np.testing.assert_allclose(found["data"]["points"][:3].transpose(2, 1, 0) / 1e3, places, atol=2 * MICROMETRE)
    assert found["header"]["points"]["first_frame"] == first


def test_frame_k_has_index_k_and_the_header_has_the_first_frame(tmp_path: Path) -> None:
    track = moving(4, first=7)
    write_c3d(tmp_path / "a.c3d", every_frame(track).trajectories())
    reader, _, points = read(tmp_path / "a.c3d")
    assert (reader.first_frame, reader.last_frame) == (1, 11)
    np.testing.assert_allclose(points[7:] / 1e3, track.trajectories().points, atol=2 * MICROMETRE)
    write_c3d(tmp_path / "b.c3d", track.trajectories())
    reader, _, points = read(tmp_path / "b.c3d")
    assert (reader.first_frame, reader.last_frame, len(points)) == (8, 11, 4)


@pytest.mark.parametrize(("axes", "up"), [("y-up", "+Y"), ("z-up", "+Z"), ("unreal", "+Z")])
def test_the_screen_parameters_give_the_up_axis(axes: Axes, up: str, tmp_path: Path) -> None:
    write_c3d(tmp_path / "a.c3d", moving().trajectories(), axes=axes)
    assert read(tmp_path / "a.c3d")[0].get("POINT:Y_SCREEN").string_value.strip() == up


def test_a_file_name_without_suffix_is_accepted_and_more_than_65535_frames_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"last frame 65539: allowed in C3D: up to 65534"):
        write_c3d(tmp_path / "a.c3d", moving(first=65528).trajectories())
    write_c3d(tmp_path / "points", moving().trajectories())
    assert [path.name for path in tmp_path.iterdir()] == ["points"]
    assert len(read(tmp_path / "points")[2]) == 12
