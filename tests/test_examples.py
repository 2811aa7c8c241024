"""Examples run, are short, and are documented, as are the tables that packages extend."""

import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest

import zenocap
from tests.measures.house import PACKAGE, sources
from tests.support.places import CLIPS, GOLDEN, ROOT
from zenocap.common.table import Table

EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))
PACKAGES = sorted(path.parent for path in (ROOT / "examples" / "plugin").glob("*/pyproject.toml"))
PAGE = ROOT / "docs" / "examples.md"
EXTEND = ROOT / "docs" / "extend.md"
Run = Callable[..., str]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Function of an example's number and its arguments: runs it in this process, and returns what it prints."""

    def run_example(number: str, *arguments: str | Path) -> str:
        (path,) = (ROOT / "examples").glob(f"{number}_*.py")
        monkeypatch.setattr(sys, "argv", [str(path), *map(str, arguments)])
        runpy.run_path(str(path), run_name="__main__")
        return capsys.readouterr().out

    return run_example


@pytest.fixture
def take(tmp_path: Path) -> Path:
    """Copy of the golden take of the demo, in which the simulated person walks."""
    return Path(shutil.copy(GOLDEN / "live.mcap", tmp_path))


def test_there_are_eleven_examples() -> None:
    assert [path.name[:2] for path in EXAMPLES] == [f"{number:02}" for number in range(1, 12)]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_short_and_shown_in_the_documentation(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 40
    assert f'```{{.python}}\n--8<-- "examples/{path.name}"\n```' in PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("folder", PACKAGES, ids=lambda path: path.name)
def test_example_package_is_shown_in_the_documentation(folder: Path) -> None:
    included = f'```{{.python}}\n--8<-- "examples/plugin/{folder.name}/{folder.name}.py"\n```'
    assert included in EXTEND.read_text(encoding="utf-8")


@pytest.mark.slow  # seven modules are imported
def test_tables_that_packages_extend_are_documented() -> None:
    tables = []
    for path in sources(ROOT, *PACKAGE):
        for name in re.findall(r"^(\w+)(?:: [^=\n]+)? = Table\(", path.read_text(encoding="utf-8"), re.MULTILINE):
            module = import_module(".".join(("zenocap", *path.relative_to(ROOT).with_suffix("").parts)))
            tables.append(getattr(module, name))
    assert len(tables) >= len(PACKAGES) > 5
    assert all(isinstance(table, Table) for table in tables)
    rows = [f"| `{table.group}` | `{table.kind.__module__}.{table.kind.__qualname__}` |" for table in tables]
    assert [row for row in rows if row not in EXTEND.read_text(encoding="utf-8")] == []


@pytest.mark.nightly
def test_the_simulated_person_is_tracked(tmp_path: Path) -> None:
    (path,) = (ROOT / "examples").glob("01_*.py")
    words = subprocess.run(
        [sys.executable, path, tmp_path / "demo.mcap"], capture_output=True, text=True, check=True
    ).stdout
    assert "567 poses at 15.0 frames/s" in words
    assert "highest right hand: " in words


@pytest.mark.slow
def test_joint_angles_are_plotted(run: Run, take: Path, tmp_path: Path) -> None:
    run("03", take, tmp_path / "knees.png")
    assert (tmp_path / "knees.png").read_bytes().startswith(b"\x89PNG")


def test_a_take_is_read_in_chunks(run: Run, take: Path) -> None:
    assert "path length of the navel over the ground: " in run("04", take)


@pytest.mark.slow
def test_a_take_is_exported(run: Run, take: Path) -> None:
    run("05", take)
    for suffix in (".bvh", ".trc", ".csv"):
        assert take.with_suffix(suffix).stat().st_size > 10_000


@pytest.mark.parametrize("tracked", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_a_rig_file_is_written_and_tracked(
    tracked: bool, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not tracked:
        monkeypatch.setattr(zenocap, "track", lambda rig, path: zenocap.open_take(shutil.copy(GOLDEN / "arms.mcap", path)))
    words = run("08", tmp_path / "arms")
    assert "rig arms: method hybrid, viewers 1, 2" in words
    assert (tmp_path / "arms" / "arms.mcap").is_file()


def test_walking_speed_is_plausible(run: Run, take: Path) -> None:
    words = run("09", take)
    highest = float(words.split("highest ")[1].split(" ")[0])
    assert 0.3 < highest < 3.0


@pytest.mark.nightly
@pytest.mark.clips
def test_a_folder_of_videos_is_tracked(run: Run, tmp_path: Path) -> None:
    assert "poses, " in run("02", CLIPS / "walk2", tmp_path / "walk.mcap")


def test_missing_folder_is_one_error_line(run: Run, tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as ended:
        run("02", tmp_path / "none", tmp_path / "x.mcap")
    assert str(ended.value).startswith("error: ")  # printed, with exit status 1
    assert len(str(ended.value).splitlines()) == 1
