"""TRC files: round trip, and reading by the shared scorer."""

import json
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.places import SHARED
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.errors import UserError
from zenocap.common.formats.trajectories import PER_METRE, Trajectories, Unit
from zenocap.common.formats.trc import HEADER, read_trc, write_trc

SCORER = SHARED / "tools" / "score_trc.py"
NAMES = tuple(marker.name for marker in TEN_PARTS.markers)


def walking(count: int = 12, seed: int = 1) -> Trajectories:
    """Joint centres that move at random, the third frame without an estimate."""
    points = np.random.default_rng(seed).uniform(-1, 2, (count, len(NAMES), 3))
    points[2] = np.nan
    frames = np.arange(count, dtype=np.int64) + 5
    return Trajectories(NAMES, frames, frames / 30.0, points, 30.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file of `walking`."""
    write_trc(tmp_path / "a.trc", walking())
    return tmp_path / "a.trc"


def test_written_files_are_read_back_in_any_unit(path: Path) -> None:
    data, again = walking(), read_trc(path)
    assert (again.names, again.rate) == (NAMES, 30.0)
    np.testing.assert_array_equal(again.frames, data.frames)
    np.testing.assert_allclose(again.times_s, data.times_s, atol=1e-6)
    np.testing.assert_allclose(again.points, data.points, atol=1e-6)
    assert np.isnan(again.points[2]).all()
    path.write_text(path.read_text().replace("\tm\t", "\tmm\t"))
    np.testing.assert_allclose(read_trc(path).points, data.points / 1000, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: "", "line 1"),
        (lambda text: text.replace("\tm\t", "\tfeet\t"), "Units = 'feet'"),
        (lambda text: text.replace("RHip", "LHip"), "line 4: LHip more than once: allowed"),
        (lambda text: text.replace("\n6\t", "\n\t"), "line 8"),  # a row without number was left out
        (lambda text: text.replace("\n5\t", "\nfive\t"), "line 7"),
        (lambda text: text.replace("30\t30\t", "x\tx\t"), "DataRate = 'x'"),
    ],
)
def test_errors_in_a_trc_file_name_the_line(path: Path, change: Callable[[str], str], words: str) -> None:
    path.write_text(change(path.read_text()))
    with pytest.raises(UserError, match=words):
        read_trc(path)


@given(st.binary(max_size=300))
def test_arbitrary_bytes_raise_at_most_a_format_error(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("trc") / "a.trc"
    path.write_bytes(b"PathFileType\t4\n" + data)
    with pytest.raises(UserError):
        read_trc(path)


@pytest.mark.slow
@pytest.mark.skipif(not SCORER.exists(), reason="the shared scorer is not beside the project")
def test_the_shared_scorer_reads_the_file(path: Path) -> None:
    command = [sys.executable, str(SCORER), str(path), str(path), "--json"]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert (found["joints"], found["frames"], found["mpjpe_mm"]) == (15, 11, 0.0)


def lines_of(path: Path) -> list[list[str]]:
    return [line.split("\t") for line in path.read_text().splitlines()]


def rewritten(path: Path, lines: list[list[str]]) -> Path:
    path.write_text("\n".join("\t".join(cells) for cells in lines) + "\n")
    return path


def test_fewer_names_than_columns_and_more_cells_than_names_are_refused(path: Path) -> None:
    """Each marker would get its neighbour's coordinates."""
    whole = path.read_text()
    path.write_text(whole.replace("Hip\t\t\tRHip", "RHip", 1))
    with pytest.raises(UserError, match="line 4: 14 names of markers for 45 columns in line 5: allowed: 3 for each"):
        read_trc(path)
    path.write_text(whole.replace("Hip\t\t\tRHip", "RHip", 1).replace("X15\tY15\tZ15", ""))
    with pytest.raises(UserError, match="line 7: 47 cells: allowed: up to 44, for the 14 markers of line 4"):
        read_trc(path)


def test_counts_in_the_header_that_contradict_the_rows_are_said(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    lines = lines_of(path)
    lines[2][2:4] = ["99", "16"]
    assert len(read_trc(rewritten(path, lines)).frames) == 12
    found = [record.getMessage().partition(": ")[2] for record in caplog.records]
    assert found == [
        "NumMarkers = 16, but there are 15: these are read",
        "NumFrames = 99, but there are 12: these are read",
    ]


def test_zeros_are_missing_points_and_said_once(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """As Mokka and Visual3D write a missing marker."""
    lines = lines_of(path)
    for row in (6, 9):
        lines[row][2 + 3 * 5 : 5 + 3 * 5] = ["0.000000", "-0.0", "1e-09"]
    found = read_trc(rewritten(path, lines))
    assert np.isnan(found.points[[0, 3], 5]).all()
    assert np.count_nonzero(np.isnan(found.points).any(axis=2)) == 2 + len(NAMES)
    assert [record.getMessage() for record in caplog.records] == [f"{path}: 2 points are 0 0 0: taken as missing"]


@pytest.mark.parametrize("number", ["9999.0", "-9999.999", "9999999", "1e10", "inf"])
def test_three_times_a_number_of_nines_is_a_missing_point(
    path: Path, caplog: pytest.LogCaptureFixture, number: str
) -> None:
    lines = lines_of(path)
    lines[6][2 + 3 * 5 : 5 + 3 * 5] = [number] * 3
    assert np.isnan(read_trc(rewritten(path, lines)).points[0, 5]).all()
    note = f"{path}: 1 points are three times {float(number):.10g}: taken as missing"
    assert [record.getMessage() for record in caplog.records] == [note] * (number != "inf")


def test_a_byte_order_mark_is_no_part_of_the_file(path: Path) -> None:
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert read_trc(path).names == NAMES


USED = "these are used"


@pytest.mark.parametrize(
    ("column", "values", "frames", "note"),
    [
        (0, ["1"] * 12, range(5, 17), "Frame# does not rise: counted from Time"),
        (0, [str(k % 5) for k in range(12)], range(5, 17), "Frame# does not rise: counted from Time"),
        (1, ["0.0"] * 12, range(5, 17), "Time does not rise: taken from Frame# and 30 frames/s"),
        (1, [""] * 12, range(5, 17), "Time does not rise: taken from Frame# and 30 frames/s"),
        (1, [f"{k / 100:.6f}" for k in range(5, 17)], range(5, 17), "DataRate = 30, but Time has 100 rows/s: " + USED),
    ],
    ids=["one number", "numbers that begin again", "one time", "no time", "another rate"],
)  # fmt: skip
def test_of_number_time_and_rate_the_time_decides(
    path: Path, caplog: pytest.LogCaptureFixture, column: int, values: list[str], frames: range, note: str
) -> None:
    lines = lines_of(path)
    for cells, value in zip(lines[6:], values, strict=True):
        cells[column] = value
    found = read_trc(rewritten(path, lines))
    assert list(found.frames) == list(frames)
    rate = 100.0 if "100" in note else 30.0
    assert found.rate == rate
    np.testing.assert_allclose(found.times_s, found.frames / rate, atol=1e-6)
    np.testing.assert_allclose(found.points[5], walking().points[5], atol=1e-6)
    assert [record.getMessage() for record in caplog.records] == [f"{path}: {note}"]


@pytest.mark.parametrize("column", [0, 1], ids=["numbers", "times"])
@pytest.mark.parametrize(("left_out", "noted"), [((0, 2), True), ((0, 1), False), ((2, 2), False)], ids=str)
def test_rows_that_only_numbers_or_only_times_leave_out_are_noted(
    path: Path, caplog: pytest.LogCaptureFixture, column: int, left_out: tuple[int, int], noted: bool
) -> None:
    """As where two trials were joined; one row is that of a camera that jitters."""
    lines = lines_of(path)
    for k, cells in enumerate(lines[6:]):
        rows = [5 + k + (k >= 6) * missing for missing in (left_out if column else left_out[::-1])]
        cells[:2] = [str(rows[0]), f"{rows[1] / 30:.6f}"]
    found = read_trc(rewritten(path, lines))
    assert (found.frames[-1], round(found.times_s[-1] * 30)) == tuple(rows)
    note = f"{path}: Frame# and Time do not leave out the same rows: the times are used"
    assert [record.getMessage() for record in caplog.records] == [note] * noted


def test_rows_without_rising_numbers_and_times_are_refused(path: Path) -> None:
    lines = lines_of(path)
    for cells in lines[6:]:
        cells[:2] = ["1", "0.0"]
    with pytest.raises(UserError, match="neither Frame# nor Time rises"):
        read_trc(rewritten(path, lines))


def tokens_as_opensim(line: str) -> list[str]:
    """OpenSim's FileAdapter::tokenize: a cell per tab, and the text after the last tab unless it is empty."""
    cells = [cell.strip() for cell in line.split("\t")]
    return cells if cells[-1] else cells[:-1]


def read_as_opensim(path: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names, times and points by the rules of OpenSim's TRCFileAdapter::extendRead, whose violations are errors there."""
    lines = path.read_text().split("\n")
    assert lines[0].split()[0] == "PathFileType"
    keys = [cell for cell in tokens_as_opensim(lines[1]) if cell]
    assert keys == HEADER.split("\t")
    values = [cell for cell in tokens_as_opensim(lines[2]) if cell]
    assert len(values) == len(keys)
    labels = [cell for cell in tokens_as_opensim(lines[3]) if cell]
    assert labels[:2] == ["Frame#", "Time"]
    count = int(values[3])
    assert len(labels) == count + 2
    assert [cell for cell in tokens_as_opensim(lines[4]) if cell] == [f"{a}{k + 1}" for k in range(count) for a in "XYZ"]
    rows = lines[5:]
    while not tokens_as_opensim(rows[0]) or not tokens_as_opensim(rows[0])[0]:
        rows = rows[1:]
    times, points = [], []
    for line in rows:
        cells = tokens_as_opensim(line)
        if not cells:
            break
        assert len(cells) == 3 * count + 2
        triples = [cells[c : c + 3] for c in range(2, len(cells), 3)]
        points.append([[float(cell) for cell in triple] if all(triple) else [np.nan] * 3 for triple in triples])
        times.append(float(cells[1]))
    assert len(times) == int(values[2])
    return labels[2:], np.array(times), np.array(points)


def read_as_pose2sim(path: Path) -> tuple[list[str], np.ndarray]:
    """Names and numbers as Pose2Sim's common.extract_trc_data reads them: every row with equally many cells."""
    names = path.read_text().splitlines()[3].strip().split("\t")[2::3]
    return names, np.genfromtxt(path, skip_header=5, delimiter="\t")[:, 1:]


@pytest.mark.parametrize("unit", ["m", "cm", "mm"])
def test_opensim_and_pose2sim_read_the_file(unit: Unit, tmp_path: Path) -> None:
    data = walking()
    write_trc(tmp_path / "a.trc", data, unit=unit)
    expected = data.points * PER_METRE[unit]
    names, times_s, points = read_as_opensim(tmp_path / "a.trc")
    assert names == list(NAMES)
    np.testing.assert_allclose(times_s, data.times_s, atol=1e-6)
    np.testing.assert_allclose(points, expected, atol=1e-6 * PER_METRE[unit])
    names, numbers = read_as_pose2sim(tmp_path / "a.trc")
    assert names == list(NAMES)
    np.testing.assert_allclose(numbers[:, 1:].reshape(points.shape), expected, atol=1e-6 * PER_METRE[unit])
    np.testing.assert_allclose(read_trc(tmp_path / "a.trc").points, data.points, atol=1e-6)


def test_lines_of_labels_end_with_a_tab_and_rows_do_not(path: Path) -> None:
    """Pose2Sim's older readers drop the last column of labels; OpenSim drops a blank cell at the end of a row."""
    lines = path.read_text().splitlines()
    assert lines[3].endswith("LWrist\t\t\t")
    assert lines[4].endswith("Z15\t")
    assert not any(line.endswith("\t") for line in lines[6:])
    assert lines[8].split("\t")[2:] == ["nan"] * 45


def test_points_are_written_in_other_axes(tmp_path: Path) -> None:
    write_trc(tmp_path / "a.trc", walking(), axes="z-up")
    x, y, z = np.moveaxis(walking().points, -1, 0)
    np.testing.assert_allclose(read_trc(tmp_path / "a.trc").points, np.stack([x, -z, y], axis=-1), atol=1e-6)


@pytest.mark.skipif(find_spec("trc") is None, reason="trc-data-reader is not installed")
def test_an_independent_package_reads_the_file(path: Path) -> None:
    read = import_module("trc").TRCData()
    read.load(str(path))
    assert (read["Markers"], read["DataRate"]) == (list(NAMES), 30.0)
    for frame, points in zip(walking().frames, walking().points, strict=True):
        np.testing.assert_allclose(np.array(read[int(frame)][1]), points, atol=1e-6)


def test_short_rows_of_many_markers_are_refused_before_memory_is_used(tmp_path, monkeypatch):
    monkeypatch.setattr("zenocap.common.formats.trc.MAX_NUMBERS", 3000)
    path = tmp_path / "many.trc"
    names = "\t\t\t".join(f"m{k}" for k in range(101))
    rows = "".join(f"{k}\t{k}\n" for k in range(10))
    path.write_text(f"PathFileType\t4\nDataRate\tUnits\n10\tm\nFrame#\tTime\t{names}\n\n{rows}")
    with pytest.raises(UserError, match="101 markers in 10 rows, 3030 coordinates: allowed: 3000"):
        read_trc(path)
