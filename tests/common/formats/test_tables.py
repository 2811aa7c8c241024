"""CSV as the csv module reads it; Parquet and NPZ with its values and metadata."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.support.pose_tracks import NAMES, moving
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.tables import unit_of, write_csv, write_npz, write_parquet
from zenocap.common.formats.trajectories import MATRICES, PER_METRE, Angle, Axes, Unit, convert

LOST = (3, 4)


def request(track: PoseTrack) -> ExportRequest:
    return ExportRequest(track, "z-up", "cm", "rad", "coco", smoothing="of this test")


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, strict=True))


@pytest.mark.parametrize("axes", list(MATRICES))
@pytest.mark.parametrize(("unit", "angle"), [("m", "deg"), ("cm", "rad"), ("mm", "deg")])
def test_written_files_are_read_back(axes: Axes, unit: Unit, angle: Angle, tmp_path: Path) -> None:
    track = moving(9, first=5, lost=(4,))
    write_csv(tmp_path / "a.csv", ExportRequest(track, axes, unit, angle))
    rows = read_csv(tmp_path / "a.csv")
    assert [int(row["frame"]) for row in rows] == list(track.frames)
    points = np.array([[[float(row[f"{n}.{a}_{unit}"] or "nan") for a in "xyz"] for n in NAMES] for row in rows])
    expected = convert(track.trajectories().points, axes)
    np.testing.assert_allclose(points / PER_METRE[unit], expected, atol=1e-6)
    angles = np.array([[float(row[f"{name}_{angle}"] or "nan") for name in track.anatomy.angles] for row in rows])
    np.testing.assert_allclose(angles, np.degrees(track.angles) if angle == "deg" else track.angles, atol=1e-6)
    np.testing.assert_allclose([float(row["score.1"]) for row in rows], track.scores["1"], atol=1e-4)
    assert {row["view.1"] for row in rows} == {"facade"}
    assert {row["score.2"] for row in rows} == {""}
    assert [row["lost"] for row in rows] == list(track.lost)


def test_every_heading_names_its_unit(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", ExportRequest(moving()))
    headings = read_csv(tmp_path / "a.csv")[0].keys()
    without = [name for name in headings if not re.search(r"_(s|m|deg)$", name)]
    assert without == ["frame", "view.1", "score.1", "view.2", "score.2", "lost"]


def test_pandas_reads_equal_tables_from_csv_and_parquet(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: pip install pandas")
    pytest.importorskip("pyarrow", reason="pyarrow is not installed: the extra tables")
    track = moving(9, lost=LOST, first=2)
    write_csv(tmp_path / "a.csv", request(track))
    write_parquet(tmp_path / "a.parquet", request(track))
    text, table = pandas.read_csv(tmp_path / "a.csv"), pandas.read_parquet(tmp_path / "a.parquet")
    assert list(table.columns) == list(text.columns)
    assert str(table["frame"].dtype) == "int64"
    for name in table.columns:
        if str(table[name].dtype) == "float64":
            np.testing.assert_allclose(table[name], text[name].astype(float), atol=1e-4, err_msg=name)
        else:
            assert list(table[name].fillna("")) == list(text[name].fillna("")), name
    assert table["RHip.x_cm"].isna().tolist() == [row in LOST for row in range(9)]


def test_parquet_says_what_the_columns_are(tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: the extra tables")
    write_parquet(tmp_path / "a.parquet", request(moving(5)))
    schema = pq.read_schema(tmp_path / "a.parquet")
    said = json.loads(schema.metadata[b"zenocap"])
    assert (said["axes"], said["unit"], said["angle"], said["joint_convention"]) == ("z-up", "cm", "rad", "COCO-17")
    assert (said["smoothing"], said["axis_directions"]["z"], said["handedness"]) == ("of this test", "up", "right")
    assert schema.field("RHip.x_cm").metadata[b"unit"] == b"cm"
    assert schema.field("neck.x_rad").metadata[b"unit"] == b"rad"


def test_npz_has_the_same_numbers_as_arrays_and_no_pickles(tmp_path: Path) -> None:
    track = moving(9, lost=LOST, first=2)
    write_npz(tmp_path / "a.npz", request(track))
    with np.load(tmp_path / "a.npz", allow_pickle=False) as found:
        names = found["joint_names"].tolist()
        expected = track.trajectories("coco")
        assert tuple(names) == expected.names
        x, y, z = np.moveaxis(expected.points * 100, -1, 0)
        np.testing.assert_allclose(found["joint_centres_cm"], np.stack([x, -z, y], axis=-1))
        np.testing.assert_array_equal(found["angles_rad"], track.angles)
        assert found["angle_names"].tolist() == list(track.anatomy.angles)
        assert (found["score"].shape, found["view"].shape) == ((9, 2), (9, 2))
        assert found["lost"].tolist() == list(track.lost)
        assert json.loads(str(found["metadata"]))["smoothing"] == "of this test"


def test_units_are_the_ends_of_names() -> None:
    assert [unit_of(name) for name in ("RHip.x_mm", "time_s", "lost", "score.1")] == ["mm", "s", "", ""]
