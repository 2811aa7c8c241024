"""OpenSim's .mot files: round trip, header, and errors that name line, column and value."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.places import CLIPS
from zenocap.common.errors import UserError
from zenocap.common.formats.mot import read_mot, write_mot

ANGLES = CLIPS / "real_beam4" / "inverse_kinematics" / "angles.mot"
HEADER = "Coordinates\nversion=1\ninDegrees=yes\nendheader\n"
ROWS = "time\thip_flexion_r\tknee_angle_r\n0.0\t1.0\t2.0\n0.1\t3.0\t4.0\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "a.mot"
    path.write_text(text)
    return path


def test_written_files_are_read_back(tmp_path: Path) -> None:
    times_s = np.arange(5) / 60.0
    columns = {"pelvis_tilt": np.linspace(-3, 8, 5), "pelvis_ty": np.full(5, 0.95)}
    write_mot(tmp_path / "a.mot", times_s, columns)
    found = read_mot(tmp_path / "a.mot")
    assert found.in_degrees
    assert found.rate == pytest.approx(60.0)
    assert list(found.columns) == list(columns)
    np.testing.assert_allclose(found.times_s, times_s, atol=1e-8)
    for name, values in columns.items():
        np.testing.assert_allclose(found.columns[name], values, atol=1e-8)
    lines = (tmp_path / "a.mot").read_text().splitlines()
    assert lines[:5] == ["Coordinates", "version=1", "nRows=5", "nColumns=3", "inDegrees=yes"]


def test_a_file_in_radians_and_one_row_are_read(tmp_path: Path) -> None:
    text = HEADER.replace("inDegrees=yes", "inDegrees=no") + "time\tknee_angle_r\n0.5\t1.25\n"
    found = read_mot(written(tmp_path, text))
    assert not found.in_degrees
    assert found.rate == 0.0
    assert found.columns["knee_angle_r"].tolist() == [1.25]


def test_rows_of_zeros_are_missing_where_there_is_a_pelvis(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    text = HEADER + "time\tpelvis_ty\thip\n0.0\t0.9\t1\n0.1\t0\t0.0\n0.2\t0.9\t0\n"
    path = written(tmp_path, text)
    assert read_mot(path).times_s.tolist() == [0.0, 0.2]
    assert [record.getMessage() for record in caplog.records] == [f"{path}: 1 rows are 0 in all columns: taken as missing"]
    assert len(read_mot(written(tmp_path, text.replace("pelvis_ty", "knee"))).times_s) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ROWS, r"a\.mot: no line 'endheader': allowed: a \.mot file of OpenSim"),
        (HEADER.replace("inDegrees=yes\n", "") + ROWS, "header: inDegrees = '': allowed: yes or no"),
        (HEADER.replace("=yes", "=perhaps") + ROWS, "header: inDegrees = 'perhaps': allowed: yes or no"),
        (HEADER, "the end: allowed: time and different names of coordinates"),
        (HEADER + "hip\tknee\n0\t1\n", "line 5: allowed: time and different names"),
        (HEADER + "time\thip\thip\n0\t1\t2\n", "line 5: allowed: time and different names"),
        (HEADER + "time\thip\n", "no rows: allowed: one or more"),
        (HEADER + ROWS.replace("3.0", "nan"), "line 7: hip_flexion_r = 'nan': allowed: a finite number"),
        (HEADER + ROWS.replace("4.0", "inf"), "line 7: knee_angle_r = 'inf': allowed: a finite number"),
        (HEADER + ROWS.replace("2.0", "two"), "line 6: knee_angle_r = 'two': allowed: a finite number"),
        (HEADER + ROWS.replace("\t4.0", ""), "line 7: 2 cells: allowed: 3, one for each column"),
        (HEADER + ROWS.replace("0.1\t", "0.0\t"), "line 7: time does not rise: allowed: a later time"),
        ("nRows=3\n" + HEADER + ROWS, "header: nrows = 3, but there are 2: allowed: as many"),
        ("nColumns=4\n" + HEADER + ROWS, "header: ncolumns = 4, but there are 3: allowed: as many"),
    ],
)
def test_errors_name_line_column_value_and_what_is_allowed(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        read_mot(written(tmp_path, text))


@pytest.mark.clips
def test_a_file_of_opensim_is_read() -> None:
    found = read_mot(ANGLES)
    assert (found.rate, len(found.columns), len(found.times_s)) == (60.0, 62, 100)
    assert found.columns["knee_angle_r"][0] == pytest.approx(20.17429573)
