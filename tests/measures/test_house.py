"""Lines, functions and repeated lines of sources."""

from pathlib import Path

import pytest

from tests.measures.house import Function, definitions, repeated, rooms, sentences, sources


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "common").mkdir()
    return tmp_path


def test_a_file_behind_a_link_counts_once(folder: Path) -> None:
    (folder / "common" / "one.py").write_text("a = 1\n")
    (folder / "zenocap").mkdir()
    (folder / "zenocap" / "common").symlink_to(folder / "common")
    assert sources(folder, "common", "zenocap") == [folder / "common" / "one.py"]


def test_repeated_lines_are_those_in_runs_of_six(folder: Path) -> None:
    run = [f"x{number} = {number}" for number in range(8)]
    one, other = folder / "common" / "one.py", folder / "common" / "other.py"
    one.write_text("\n".join(["import os", *run, "y = 1"]))
    other.write_text("\n".join(["z = 2", *(f"    {line}" for line in run)]))
    assert repeated([one]) == 0
    assert repeated([one, other]) == 2 * len(run)


def test_sentences_of_a_page_are_those_of_its_text(folder: Path) -> None:
    page = folder / "page.md"
    table = "<!-- table kind -->\n| a | b. c |\n\n*How it\nwas measured.*\n<!-- end -->"
    page.write_text(
        f"# A title\n\nOne of 1.5 m\non two lines. Another: <!-- figure a b c -->3 (4)<!-- end --> mm.\n{table}\n"
        "- an item\n  that goes on\n- **a second** one\n\n```sh\nno sentence.\n```\n| a cell. |\n![A picture.](a.png)\nEnd"
    )
    assert sentences(page) == [
        "One of 1.5 m on two lines.", "Another:", "3 (4) mm.", "an item that goes on", "**a second** one", "End",
    ]  # fmt: skip


def test_kernels_are_known_by_their_decorator(folder: Path) -> None:
    path = folder / "common" / "one.py"
    path.write_text("@kernel\ndef a(x):\n    return x\n\n\ndef b(x):\n    return x\n")
    assert definitions(path).functions == (Function(2, 1, True), Function(2, 1, False))


def test_definitions_are_found_at_any_depth(folder: Path) -> None:
    path = folder / "common" / "one.py"
    inner = {"if x:": "class A: pass", "class B:": "def b(self, x, /, y, *, z): pass", "for _ in x:": "async def c(): pass"}
    tried = "try:\n    pass\nexcept ValueError:\n    class C: pass\nelse:\n    class D: pass\nfinally:\n    class E: pass\n"
    text = "".join(f"{outer}\n    {line}\n" for outer, line in inner.items())
    path.write_text(text + tried + "match x:\n    case 1:\n        class F: pass\n")
    assert sorted(definitions(path).classes) == ["A", "B", "C", "D", "E", "F"]
    assert [function.positional for function in definitions(path).functions] == [2, 0]


def test_a_folder_that_an_earlier_commit_has_left_is_no_room(folder: Path) -> None:
    for place in ("common/bus", "common/left/__pycache__", "services", "tools"):
        (folder / place).mkdir(parents=True)
    (folder / "common" / "bus" / "one.py").write_text("a = 1\n")
    assert [name for name in rooms(folder) if name.startswith("common/")] == ["common/*.py", "common/bus"]
