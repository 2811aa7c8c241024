"""Manifests of examples: tolerant reading, and all errors of a file reported together."""

from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.manifest import MOST_ALIKE, ManifestRow, read_manifest, summarized, write_manifest


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.mcap", "b.bvh", "c.trc", "rig.toml", "notes.txt"):
        (tmp_path / name).touch()
    (tmp_path / "clip").mkdir()
    return tmp_path


def manifest(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    (folder / "m.csv").write_bytes(text.encode(encoding))
    return folder / "m.csv"


def test_rows_are_read_with_times_in_seconds_and_sources_beside_the_manifest(folder: Path) -> None:
    path = manifest(folder, "source,start,end,posture,person,repetition\na.mcap,1.5,4,kick,ann,1\nb.bvh,,,wave,bob,7\n")
    assert read_manifest(path) == [
        ManifestRow(2, folder / "a.mcap", 1.5, 4.0, "kick", "ann", "1"),
        ManifestRow(3, folder / "b.bvh", None, None, "wave", "bob", "7"),
    ]


@pytest.mark.parametrize("first", ["take", "clip", "file", "Source", " TAKE "])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_exports_of_spreadsheet_programs_are_read(folder: Path, first: str, delimiter: str) -> None:
    text = f"posture,{first}\r\nkick,clip\r\n\r\n,\r\nkick,rig.toml\r\nBücken,a.mcap\r\n".replace(",", delimiter)
    rows = read_manifest(manifest(folder, text, "utf-8-sig"))
    assert [(row.line, row.source.name, row.posture, row.person, row.repetition) for row in rows] == [
        (2, "clip", "kick", "1", "1"),
        (5, "rig.toml", "kick", "1", "2"),
        (6, "a.mcap", "Bücken", "1", "1"),
    ]
    assert [row.is_rig for row in rows] == [True, True, False]


def test_all_errors_are_reported_together(folder: Path) -> None:
    path = manifest(
        folder,
        "source,start,end,posture,person,repetition\n"
        "nowhere.mcap,,,kick,ann,1\n"
        "a.mcap,2,2,kick,ann,2\n"
        "a.mcap,soon,,kick,ann,3\n"
        "a.mcap,-1,nan,kick,ann,4\n"
        f"b.bvh,,,{'x' * 65},ann,5\n"
        "b.bvh,,,,ann,6\n"
        "notes.txt,,,kick,ann,7\n"
        "c.trc,,,kick,ann,8,9\n"
        ",,,kick,ann,9\n"
        "a.mcap,1,2,kick,ann,10\n"
        "a.mcap,1.0,2.0,wave,ann,11\n",
    )
    with pytest.raises(UserError) as raised:
        read_manifest(path)
    lines = str(raised.value).splitlines()
    expected = [
        (2, "source = 'nowhere.mcap': allowed: a file or folder that exists"),
        (3, "end = '2': allowed: seconds after start = 2"),
        (4, "start = 'soon': allowed: seconds from the start of the source"),
        (5, "start = '-1': allowed: seconds"),
        (5, "end = 'nan': allowed: seconds"),
        (6, "posture = 'xxx"),
        (7, "posture = '': allowed: 1 to 64 printable characters"),
        (8, "source = 'notes.txt': allowed: .mcap, .bvh, .trc, .c3d"),
        (9, "7 cells: allowed: 6"),
        (10, "source = '': allowed: a file"),
        (12, "the same span of"),
    ]
    assert len(lines) == len(expected)
    for line, (number, words) in zip(lines, expected, strict=True):
        assert line.startswith(f"{path}: line {number}: ")
        assert words in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "line 1: empty: allowed: the columns source,start,end"),
        ("source,posture\n", "no rows after the first line"),
        ("source,pose\n", "line 1: column 'pose', no column 'posture': allowed: source, start"),
        ("source,take,posture\n", "column 'source' more than once"),
        ('source,posture\na.mcap,"kick\n', "m.csv: line 2: unexpected end of data: allowed: one row per line"),
    ],
)
def test_error_names_a_file_that_is_not_a_manifest(folder: Path, text: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        read_manifest(manifest(folder, text))


def test_unreadable_files_are_refused(folder: Path) -> None:
    (folder / "m.csv").write_bytes(b"ab\xff\x00")
    with pytest.raises(UserError, match=r"m\.csv: not a CSV file: no text in UTF-8"):
        read_manifest(folder / "m.csv")
    with pytest.raises(UserError, match=r"no\.csv: cannot be read: No such file"):
        read_manifest(folder / "no.csv")


def test_a_written_manifest_is_read_back(folder: Path) -> None:
    rows = [
        ManifestRow(2, folder / "a.mcap", 0.25, 3.5, 'say "hi", then wave', "ann", "1"),
        ManifestRow(3, folder / "clip", None, None, "右手", "bob", "2"),
    ]
    write_manifest(folder / "m.csv", rows)
    assert read_manifest(folder / "m.csv") == rows
    assert str(folder) not in (folder / "m.csv").read_text()


def test_many_errors_of_one_kind_are_one_line_with_their_number(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    rows = [f"missing{k}.mcap,{k},,kick" for k in range(100)]
    path.write_text("\n".join(["source,start,end,posture", *rows, "here.txt,,,kick"]), encoding="utf-8")
    (tmp_path / "here.txt").touch()
    with pytest.raises(UserError) as raised:
        read_manifest(path)
    first, other = str(raised.value).splitlines()
    assert first.startswith(f"{path}: line 2: source = 'missing0.mcap'")
    assert first.endswith("(and 99 more of this kind)")
    assert other.startswith(f"{path}: line 102: source = 'here.txt'")


def test_few_errors_of_one_kind_are_all_listed() -> None:
    few = [f"m.csv: line {k}: end = '{k}': allowed: more" for k in range(MOST_ALIKE)]
    assert summarized(few) == few
    assert summarized([*few, "m.csv: line 9: end = 'x': allowed: more"]) == [
        f"{few[0]} (and {MOST_ALIKE} more of this kind)"
    ]


def test_sources_are_named_relative_to_the_manifest() -> None:
    row = ManifestRow(3, Path("lab/takes/a.mcap"), 1.0, None, "kick", "1", "1")
    assert row.text(Path("lab")) == "line 3: takes/a.mcap from 1 s to start or end"
    assert row.text(Path("elsewhere")) == "line 3: lab/takes/a.mcap from 1 s to start or end"
