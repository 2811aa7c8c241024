"""Files that are replaced whole, or that replace none."""

import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from zenocap.common.atomic_write import new_file, write_atomically


def written(path: Path, text: str) -> None:
    write_atomically(path, text.encode(), new=True)


def renamed(path: Path, text: str) -> None:
    with new_file(path) as unfinished:
        unfinished.write_text(text)


WAYS = [written, renamed]


@pytest.mark.parametrize("write", WAYS)
def test_a_new_file_replaces_none_and_leaves_nothing_beside_it(tmp_path: Path, write: Callable[[Path, str], None]) -> None:
    path = tmp_path / "a.toml"
    write(path, "first")
    with pytest.raises(FileExistsError):
        write(path, "second")
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [("a.toml", "first")]


@pytest.mark.parametrize("write", WAYS)
def test_a_link_to_nowhere_is_a_file_too(tmp_path: Path, write: Callable[[Path, str], None]) -> None:
    path = tmp_path / "a.toml"
    path.symlink_to(tmp_path / "away.toml")
    with pytest.raises(FileExistsError):
        write(path, "second")
    assert path.is_symlink()


@pytest.mark.parametrize("write", WAYS)
def test_a_rename_that_fails_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Callable[[Path, str], None]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        write(tmp_path / "a.toml", "first")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", WAYS)
def test_of_writers_at_the_same_time_one_has_the_name(tmp_path: Path, write: Callable[[Path, str], None]) -> None:
    path, refused, begin = tmp_path / "a.toml", list[int](), threading.Barrier(8)

    def run(number: int) -> None:
        begin.wait()
        try:
            write(path, str(number))
        except FileExistsError:
            refused.append(number)

    threads = [threading.Thread(target=run, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted([*refused, int(path.read_text())]) == list(range(8))
