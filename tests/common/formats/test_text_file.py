"""Readers of text files refuse what they cannot read, in one line with the file's name."""

from collections.abc import Callable
from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_reader import read_bvh
from zenocap.common.formats.mot import read_mot
from zenocap.common.formats.opensim_model import read_model
from zenocap.common.formats.text_file import read_text
from zenocap.common.formats.trc import read_trc


@pytest.mark.parametrize(
    ("read", "kind"),
    [(read_bvh, "a BVH file"), (read_mot, r"a \.mot file"), (read_model, r"an \.osim file"), (read_trc, "a TRC file")],
)
def test_missing_and_binary_files_are_errors(read: Callable[[Path], object], kind: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"/a: cannot be read: No such file"):
        read(tmp_path / "a")
    (tmp_path / "b").write_bytes(b"\x00\xff\x81")
    with pytest.raises(UserError, match=f"/b: not {kind}: "):
        read(tmp_path / "b")


def test_a_file_above_the_limit_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text("HIERARCHY")
    with pytest.raises(UserError, match=r"a\.bvh: larger than 0 MiB: allowed: a BVH file below that"):
        read_text(tmp_path / "a.bvh", "a BVH file", 8)


@pytest.mark.parametrize(
    ("encoding", "notes"),
    [
        ("cp1252", ["is not UTF-8: read as Windows-1252; names with other letters may be wrong"]),
        ("utf-16", []),
        ("utf-8-sig", []),
        ("utf-8", []),
    ],
)
def test_text_of_windows_is_read_and_a_guess_is_noted(
    encoding: str, notes: list[str], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The first line of a TRC file is a path."""
    text = "PathFileType\t4\t(X/Y/Z)\tC:\\Users\\Jörg\\gait.trc\n"
    (tmp_path / "a.trc").write_text(text, encoding=encoding, newline="\r\n")
    assert read_text(tmp_path / "a.trc", "a TRC file") == text
    assert caplog.messages == [f"{tmp_path / 'a.trc'}: {note}" for note in notes]
