"""C3D files of other programs: units, first frames, other quantities, damage."""

import io
import struct
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import c3d
import ezc3d
import numpy as np
import pytest

from tests.support.marker_files import FRAMES, acted_centres, write_points
from tests.support.pose_tracks import moving
from zenocap.common.errors import UserError
from zenocap.common.formats.c3d import write_c3d
from zenocap.common.formats.c3d_reader import read_c3d, with_whole_frames


def test_written_files_are_read_back_with_frames_and_gaps(tmp_path: Path) -> None:
    data = moving(20, lost=(3, 4), rate=50.0).trajectories()
    write_c3d(tmp_path / "a.c3d", data)
    found = read_c3d(tmp_path / "a.c3d")
    assert (found.names, found.rate) == (data.names, 50.0)
    np.testing.assert_array_equal(found.frames, data.frames)
    np.testing.assert_allclose(found.times_s, data.frames / 50.0)
    np.testing.assert_allclose(found.points, data.points, atol=1e-6)


def test_a_file_whose_number_of_rows_is_whole_is_not_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "TemporaryDirectory", lambda: pytest.fail("a folder"))
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("the whole file"))
    write_c3d(tmp_path / "a.c3d", moving(20).trajectories())
    with ExitStack() as stack:
        assert with_whole_frames(tmp_path / "a.c3d", stack) == (tmp_path / "a.c3d", None)


def independent_file(path: Path, names: list[str]) -> Path:
    """Acted centres as the library c3d writes them."""
    writer = c3d.Writer(point_rate=120.0)
    rows = np.zeros((FRAMES, len(acted_centres()), 5), dtype=np.float32)
    rows[:, :, :3] = np.stack(list(acted_centres().values()), axis=1) * 1000.0
    writer.add_frames([(row, np.zeros((0, 0))) for row in rows])
    writer.set_point_labels(names)
    content = io.BytesIO()
    writer.write(content)
    path.write_bytes(content.getvalue())
    return path


def test_a_file_of_an_independent_library_is_read(tmp_path: Path) -> None:
    centres = acted_centres()
    found = read_c3d(independent_file(tmp_path / "a.c3d", list(centres)))
    assert found.rate == 120.0
    for k, name in enumerate(found.names):
        np.testing.assert_allclose(found.points[:, k], centres[name], atol=1e-5)


@pytest.mark.parametrize("content", [b"", b"\x02\x50", b"not a C3D file" * 100, b"\x02\x50" + bytes(510)])
def test_other_files_are_one_line_errors(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.c3d").write_bytes(content)
    with pytest.raises(UserError, match=r"a\.c3d: ") as raised:
        read_c3d(tmp_path / "a.c3d")
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.95])
def test_a_missing_and_a_cut_file_are_errors(tmp_path: Path, share: float) -> None:
    path = tmp_path / "a.c3d"
    with pytest.raises(UserError, match=r"a\.c3d: cannot be read: No such file"):
        read_c3d(path)
    write_points(path, acted_centres())
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(UserError, match=r"a\.c3d: "):
        read_c3d(path)


FALSE_DIMENSION, FALSE_LENGTH = (b"CHANNEL\x06\x00\x02", 247), (b"_START\x07\x00\x02\x00\x1d\x00", 179)


def damage(path: Path, before: bytes, value: int) -> None:
    """Replace the byte behind `before`."""
    content = bytearray(path.read_bytes())
    content[content.index(before) + len(before)] = value
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("place", "text"), [(FALSE_DIMENSION, "reading it was ended by SIGSEGV"), (FALSE_LENGTH, "bad_alloc")]
)
def test_damage_that_ends_the_library_is_a_one_line_error(tmp_path: Path, place: tuple[bytes, int], text: str) -> None:
    """By a false dimension, which ezc3d follows beyond its memory, or by a length for which it takes all memory."""
    path = tmp_path / "a.c3d"
    write_points(path, acted_centres())
    damage(path, *place)
    with pytest.raises(UserError, match=rf"^{path}: not a C3D file: .*{text}$"):
        read_c3d(path)


def late_file(
    path: Path, first: int, actual: tuple[int, int] | None, unit: str = "mm", long_frames: int | None = None
) -> Path:
    """20 rows from a number on; the header's is `first`.  actual: numbers of TRIAL, two words each."""
    data = moving(20, first=first - 1).trajectories()
    write_c3d(path, data)
    file = ezc3d.c3d(str(path))
    for end, number in zip(("START", "END"), actual or (), strict=False):
        file.add_parameter("TRIAL", f"ACTUAL_{end}_FIELD", [number & 0xFFFF, number >> 16])
    if long_frames is not None:
        file.add_parameter("POINT", "LONG_FRAMES", [float(long_frames)])
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file.write(str(path))
    return path


@pytest.mark.parametrize(
    ("first", "actual", "found", "note"),
    [
        (101, (101, 120), 100, None),
        (101, (70001, 70020), 70000, "first frame 101 in the header, TRIAL:ACTUAL_START_FIELD = 70001: the latter is used"),
        (101, (1, 500), 100, "TRIAL:ACTUAL_START_FIELD = 1, but first frame 101 in the header: the latter is used"),
        (101, (0, 0), 100, None),
        (101, None, 100, None),
    ],
    ids=["equal", "beyond the header", "of the whole trial", "not filled in", "none"],
)
def test_the_first_frame_of_the_trial_is_used_where_it_agrees_with_the_rows(
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    first: int,
    actual: tuple[int, int] | None,
    found: int,
    note: str | None,
) -> None:
    path = late_file(tmp_path / "a.c3d", first, actual)
    assert read_c3d(path).frames[0] == found
    assert [record.getMessage() for record in caplog.records] == ([f"{path}: {note}"] if note else [])


@pytest.mark.parametrize(
    ("header", "stated", "used", "note"),
    [
        (50.0, 30.0, 30.0, "50 frames/s in the header, POINT:RATE = 30: 30 frames/s are used"),
        (50.0, 0.0, 50.0, None),
        (29.97, 30.0, 30.0, None),
        (0.0, 30.0, 30.0, None),
    ],
)
def test_a_rate_in_the_header_that_contradicts_the_parameter_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, header: float, stated: float, used: float, note: str | None
) -> None:
    path = tmp_path / "a.c3d"
    write_c3d(path, moving(20).trajectories())
    content = bytearray(path.read_bytes())
    at = content.index(b"\xfc\x01RATE") + 6  # length of the name, locked; group; then offset, type, dimensions, value
    content[at + 4 : at + 8] = struct.pack("<f", stated)
    content[20:24] = struct.pack("<f", header)
    path.write_bytes(content)
    found = read_c3d(path)
    assert found.rate == used
    np.testing.assert_allclose(np.diff(found.times_s), 1 / used)
    assert [record.getMessage() for record in caplog.records] == ([f"{path}: {note}"] if note else [])


@pytest.mark.parametrize(
    ("actual", "counts", "note"),
    [
        ((101, 70120), {}, "20 rows are read, but there are TRIAL:ACTUAL_END_FIELD = 70120 of rows from 101 on"),
        (None, {"LONG_FRAMES": 70000}, "20 rows are read, but there are 70000 in its parameters"),
        (None, {"FRAMES": 12}, "12 rows are read, but there are 20 in the header"),
        (None, {"FRAMES": 12, "header": 12}, "12 rows are read, but there are 2240 bytes behind them"),
        ((0, 0), {"LONG_FRAMES": 20}, None),
    ],
)
def test_another_number_of_rows_than_is_read_is_said(
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    actual: tuple[int, int] | None,
    counts: Mapping[str, int],
    note: str | None,
) -> None:
    """A C3D counts up to 65535 rows."""
    path = late_file(tmp_path / "a.c3d", 101, actual, long_frames=counts.get("LONG_FRAMES"))
    content = bytearray(path.read_bytes())
    at = content.index(b"\x01FRAMES") + 11
    content[at : at + 2] = struct.pack("<H", counts.get("FRAMES", 20))
    content[8:10] = struct.pack("<H", 100 + counts.get("header", 20))
    path.write_bytes(content)
    read_c3d(path)
    assert [record.getMessage() for record in caplog.records] == ([f"{path}: {note}"] if note else [])


@pytest.mark.parametrize("dimensions", [b"\0", b"\x01\x01"], ids=["a number", "an array of one"])
@pytest.mark.parametrize(("count", "read"), [(20, 20), (70000, 65535)])
def test_a_number_of_rows_that_is_no_whole_number_is_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, count: int, read: int, dimensions: bytes
) -> None:
    """As programs write it for long captures."""
    path, data = tmp_path / "a.c3d", moving(20).trajectories()
    write_c3d(path, replace(data, names=data.names[:1], points=data.points[:, :1]))
    content = path.read_bytes()
    at, rows = content.index(b"\x01FRAMES") + 7, 512 * (content[16] - 1)
    offset = int.from_bytes(content[at : at + 2], "little") + 1 + len(dimensions)
    number = offset.to_bytes(2, "little") + b"\x04" + dimensions + struct.pack("<f", count)
    parameters = content[:at] + number + content[at + 6 : rows - 1 - len(dimensions)]
    first = count // 20 * content[rows : rows + 20 * 16]
    path.write_bytes(parameters[:8] + struct.pack("<H", min(count, 65535)) + parameters[10:] + first)
    found = read_c3d(path)
    assert len(found.frames) == read
    np.testing.assert_allclose(found.points[-20:], found.points[read % 20 : read % 20 + 20])
    note = f"{path}: {read} rows are read, but there are {count} in its parameters, {16 * (count - read)} bytes behind them"
    assert caplog.messages == ([] if count == read else [note])


def test_other_numbers_of_names_are_said_and_two_numbers_of_points_are_refused(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, names = tmp_path / "a.c3d", list(acted_centres())
    for given in (names[:-2], [*names, "extra"]):
        assert list(read_c3d(independent_file(path, given)).names) == given[: len(names)]
        text = f"{path}: POINT:LABELS has {len(given)} names for {len(names)} points: the last ones are left out"
        assert caplog.messages[-1] == text
    damage(independent_file(path, names), b"\x02\x50", len(names) + 1)
    with pytest.raises(UserError, match=f"POINT:USED = {len(names)}, {len(names) + 1} points in the header: allowed"):
        read_c3d(path)


def test_a_blank_unit_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="POINT:UNITS = '': allowed: m, cm, mm, in"):
        read_c3d(late_file(tmp_path / "a.c3d", 1, None, unit=" "))


def test_zeros_with_a_valid_residual_are_missing_and_said_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    data = moving(20).trajectories()
    data.points[3:5, 2] = 0.0
    data.points[6, 3] = 9.999  # 9999 in the millimetres of the file
    write_c3d(tmp_path / "a.c3d", data)
    found = read_c3d(tmp_path / "a.c3d").points
    assert [tuple(at) for at in np.argwhere(np.isnan(found).all(axis=2))] == [(3, 2), (4, 2), (6, 3)]
    assert [record.getMessage().partition(": ")[2] for record in caplog.records] == [
        "2 points are 0 0 0: taken as missing",
        "1 points are three times 9999: taken as missing",
    ]


def test_points_with_a_residual_below_zero_are_missing_wherever_they_are(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """As Vicon writes them, which leaves coordinates of before."""
    path = tmp_path / "a.c3d"
    write_c3d(path, moving(20).trajectories())
    content = bytearray(path.read_bytes())
    struct.pack_into("<f", content, 512 * (content[16] - 1) + 16 * 4 + 12, -1.0)
    path.write_bytes(content)
    assert [tuple(at) for at in np.argwhere(np.isnan(read_c3d(path).points).all(axis=2))] == [(0, 4)]
    assert caplog.messages == []
