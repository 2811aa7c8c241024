"""Parquet and NPZ: values of the CSV file, with units, axes and smoothing as metadata."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.pose_tracks import moving
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.tables import unit_of, write_csv, write_npz, write_parquet

pandas = pytest.importorskip("pandas", reason="pandas is not installed: pip install pandas")
LOST = (3, 4)


def request(track: PoseTrack) -> ExportRequest:
    return ExportRequest(track, "z-up", "cm", "rad", "coco", smoothing="of this test")


def test_pandas_reads_equal_tables_from_csv_and_parquet(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="pyarrow is not installed: pip install 'zenocap[tables]'")
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
    pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed: pip install 'zenocap[tables]'")
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


@pytest.mark.parametrize(("name", "unit"), [("RHip.x_mm", "mm"), ("time_s", "s"), ("lost", ""), ("score.1", "")])
def test_units_are_the_ends_of_names(name: str, unit: str) -> None:
    assert unit_of(name) == unit
