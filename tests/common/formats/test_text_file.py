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
    (tmp_path / "b").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(UserError, match=f"/b: not {kind}: "):
        read(tmp_path / "b")


def test_a_file_above_the_limit_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text("HIERARCHY")
    with pytest.raises(UserError, match=r"a\.bvh: larger than 0 MiB: allowed: a BVH file below that"):
        read_text(tmp_path / "a.bvh", "a BVH file", 8)
