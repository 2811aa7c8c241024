"""The disk's end is said before it comes."""

import shutil
from collections import namedtuple
from pathlib import Path

import pytest

from common.take.space import Space, shortage

Usage = namedtuple("Usage", "total used free")


@pytest.mark.parametrize(
    ("free", "rate", "words"),
    [
        (10**12, 1e6, None),
        (2 * 10**9, 0.0, None),
        (5 * 10**8, 0.0, "the disk is nearly full: 500 MB free"),
        (5 * 10**8, 1e6, "the disk is nearly full: 500 MB free, 8 minutes at the present rate"),
        (3 * 10**9, 1e7, "the disk is nearly full: 3000 MB free, 5 minutes at the present rate"),
    ],
)
def test_a_gigabyte_or_ten_minutes_are_few(free: int, rate: float, words: str | None) -> None:
    assert shortage(free, rate) == words


def test_it_is_said_once_until_there_is_room_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    space = Space(tmp_path)
    for free, said in ((10**12, 0), (10**6, 1), (10**5, 1), (10**12, 1), (10**6, 2)):
        monkeypatch.setattr(shutil, "disk_usage", lambda _, free=free: Usage(0, 0, free))
        space.look(0.0)
        assert space.free_bytes == free
        assert caplog.text.count("nearly full") == said


def test_a_folder_that_is_gone_is_not_known(tmp_path: Path) -> None:
    space = Space(tmp_path / "gone")
    space.look(1.0)
    assert space.free_bytes is None
