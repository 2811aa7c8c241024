"""Labels along one long source: spans, examples, errors with file and line."""

from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.label_table import read_spans
from zenocap.services.recognizer.training.manifest import read_manifest


def table(folder: Path, text: str, name: str = "labels.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def spans(path: Path) -> list[tuple[float, float | None, str]]:
    return [(span.start, span.end, span.label) for span in read_spans(path)]


CHANGES = "time,label\n0,\n1.0,kick\n2.0,-\n4.0,\n5.0,wave\n"


def test_a_label_holds_until_the_next_row(tmp_path: Path) -> None:
    assert spans(table(tmp_path, CHANGES)) == [(1.0, 2.0, "kick"), (2.0, 4.0, "-"), (5.0, None, "wave")]


def test_a_row_per_frame_is_the_same_as_a_row_per_change(tmp_path: Path) -> None:
    def label(time_s: float) -> str:
        return "" if time_s < 1 else "kick" if time_s < 2 else "-" if time_s < 4 else "" if time_s < 5 else "wave"

    frames = [k / 25 for k in range(150)]
    text = "frame;Time;label\n" + "".join(f"{k};{time_s};{label(time_s)}\n" for k, time_s in enumerate(frames))
    assert spans(table(tmp_path, text)) == spans(table(tmp_path, CHANGES, "changes.csv"))


def test_each_span_is_an_example_of_the_manifest(tmp_path: Path) -> None:
    table(tmp_path, CHANGES.replace("wave", "kick"))
    (tmp_path / "long.mcap").touch()
    (tmp_path / "other.mcap").touch()
    manifest = table(
        tmp_path, "source,labels,posture,start,person\nlong.mcap,labels.csv,,,ann\nother.mcap,,kick,3,ann\n", "m.csv"
    )
    found = [
        (row.line, row.source.name, row.start, row.end, row.posture, row.repetition) for row in read_manifest(manifest)
    ]
    assert found == [
        (2, "long.mcap", 1.0, 2.0, "kick", "1"),
        (2, "long.mcap", 2.0, 4.0, "-", "1"),
        (2, "long.mcap", 5.0, None, "kick", "2"),
        (3, "other.mcap", 3.0, None, "kick", "3"),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,posture\n0,kick\n", "line 1: 'time,posture': allowed: the columns time, label, once each"),
        ("time,label\n", "no labels: allowed: one or more"),
        ("time,label\n0,\n3,\n", "no labels: allowed: one or more"),
        ("time,label\nnow,kick\n", "line 2: time = 'now': allowed: seconds from the start of the source, 0 to 1e\\+06"),
        ("time,label\nnan,kick\n", "line 2: time = 'nan': allowed: seconds"),
        ("time,label\n-1,kick\n", "line 2: time = '-1': allowed: seconds"),
        ("time,label\n2,kick\n2,wave\n", "line 3: time = 2: allowed: later than 2, the time of the row before"),
        ("time,label\n2,ki\x07ck\n", "line 2: label = 'ki.x07ck': allowed: at most"),
        ('time,label\n2,"kick\n', "allowed: one row per line"),
    ],
)
def test_errors_name_file_line_and_what_is_allowed(tmp_path: Path, text: str, message: str) -> None:
    path = table(tmp_path, text)
    with pytest.raises(UserError, match=f"{path}: .*{message}|{path}: {message}"):
        read_spans(path)


def test_errors_of_a_table_are_errors_of_the_manifest(tmp_path: Path) -> None:
    (tmp_path / "long.mcap").touch()
    bad = table(tmp_path, "time,label\n3,kick\n1,wave\n")
    manifest = table(
        tmp_path, "source,labels,posture\nlong.mcap,labels.csv,\nlong.mcap,none.csv,\nlong.mcap,labels.csv,kick\n", "m.csv"
    )
    with pytest.raises(UserError) as caught:
        read_manifest(manifest)
    lines = str(caught.value).splitlines()
    assert lines[0] == f"{bad}: line 3: time = 1: allowed: later than 3, the time of the row before"
    assert lines[1] == f"{tmp_path / 'none.csv'}: cannot be read: No such file or directory"
    assert lines[2] == f"{manifest}: line 4: posture = 'kick': allowed: an empty cell beside labels"
