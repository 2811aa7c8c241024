"""Stored results of tests are made again when their key, sources or entry differ."""

from pathlib import Path

import pytest

from tests.support import stored as module
from tests.support.stored import stored, stored_files


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


class Maker:
    def __init__(self) -> None:
        self.count = 0

    def __call__(self) -> int:
        self.count += 1
        return self.count


def test_a_value_is_made_once_for_each_key_and_each_list_of_sources() -> None:
    make = Maker()
    assert [stored(make, 1), stored(make, 1), stored(make, 2), stored(make, 1)] == [1, 1, 2, 1]
    assert stored(make, 1, sources=["zenocap.simulation.body"]) == 3


def test_a_change_of_the_sources_makes_it_again(monkeypatch: pytest.MonkeyPatch) -> None:
    make = Maker()
    before = stored(make, sources=["zenocap.common.arrays"])
    texts = module._sources().texts
    monkeypatch.setitem(texts, "zenocap/common/arrays.py", texts["zenocap/common/arrays.py"] + "\n")
    module._digest.cache_clear()
    assert stored(make, sources=["zenocap.common.arrays"]) == before + 1
    module._digest.cache_clear()


@pytest.mark.parametrize("content", [b"", b"of another program"])
def test_a_damaged_entry_is_made_again(cache: Path, content: bytes) -> None:
    make = Maker()
    stored(make)
    (entry,) = (path for path in (cache / "tests").rglob("*") if path.is_file())
    entry.write_bytes(content)
    assert [stored(make), stored(make)] == [2, 2]


def test_files_are_copied_where_they_are_wanted(tmp_path: Path) -> None:
    def write(folder: Path) -> None:
        (folder / "inside").mkdir()
        (folder / "inside" / "a.txt").write_text("content")
        made.append(folder)

    made: list[Path] = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        folder = stored_files(tmp_path / name, write, sources=["zenocap.common.arrays"])
        assert (folder / "inside" / "a.txt").read_text() == "content"
    assert made == [tmp_path / "one"]


def test_an_unknown_source_is_refused() -> None:
    with pytest.raises(ValueError, match="no module of zenocap or of the tests"):
        stored(int, sources=["zenocap.commom"])
