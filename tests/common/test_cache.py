"""Entries of the user's cache: whole, of this user, or missing."""

import os
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from zenocap.common.cache import UNUSED_DAYS, cache_folder, mark_used, read_entry, write_entry


def test_the_folder_is_that_of_the_variable_or_in_the_users_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path))
    assert cache_folder() == tmp_path
    monkeypatch.delenv("ZENOCAP_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    assert cache_folder() == tmp_path / "user" / "zenocap"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "zenocap"
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    assert cache_folder() == Path(tempfile.gettempdir()) / f"zenocap-{os.geteuid()}"


@pytest.mark.parametrize("content", [b"", b"a", bytes(100_000)])
def test_an_entry_is_read_as_written(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "folder" / "entry"
    assert read_entry(path) is None
    assert write_entry(path, content)
    assert read_entry(path) == content
    assert path.parent.stat().st_mode & 0o077 == 0
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda data: data + b"x", lambda _: b"", lambda _: b"short",
                                    lambda data: data[:40] + b"X" + data[41:]])  # fmt: skip
def test_a_damaged_entry_counts_as_missing(tmp_path: Path, damage) -> None:
    path = tmp_path / "entry"
    write_entry(path, b"some content of an entry")
    path.write_bytes(damage(path.read_bytes()))
    assert read_entry(path) is None
    assert write_entry(path, b"new")
    assert read_entry(path) == b"new"


def test_an_entry_of_another_user_counts_as_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "entry"
    write_entry(path, b"content")
    if os.geteuid() == 0:
        os.chown(path, 12345, 12345)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: 12345)
    assert read_entry(path) is None


def test_a_folder_that_cannot_be_written_raises_no_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    assert not write_entry(tmp_path / "file" / "entry", b"content")
    assert read_entry(tmp_path / "file" / "entry") is None
    mark_used(tmp_path / "file" / "folder")


def test_parallel_writers_leave_one_whole_entry(tmp_path: Path) -> None:
    path = tmp_path / "entry"
    contents = [bytes([k]) * 50_000 for k in range(8)]
    with ThreadPoolExecutor(len(contents)) as writers:
        list(writers.map(lambda content: write_entry(path, content), contents))
    assert read_entry(path) in contents


def test_folders_that_nothing_uses_are_deleted(tmp_path: Path) -> None:
    used, recent, unused = (tmp_path / name for name in ("used", "recent", "unused"))
    now_s = time.time()
    for folder, days in ((used, 2), (recent, UNUSED_DAYS - 1), (unused, UNUSED_DAYS + 1)):
        folder.mkdir()
        (folder / "entry").write_bytes(b"")
        os.utime(folder, (now_s - days * 86_400,) * 2)
    mark_used(used)
    assert used.stat().st_mtime > now_s - 60
    assert sorted(path.name for path in tmp_path.iterdir()) == ["recent", "used"]
